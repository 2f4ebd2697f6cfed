"use strict";
/* Shows bodies as GLB in <model-viewer>: one at a time, turned by mouse, finger or arrow keys. */
async function showBodies(bodies, place) {
  if (bodies.length === 0) return;
  if (document.createElement("canvas").getContext("webgl2") === null) {
    place.append(made("p", { className: "caption", textContent: "This browser draws nothing in three dimensions (WebGL is off or missing). The files of the part open in any CAD program or slicer." }));
    return;
  }
  /* The first body of each kind of an assembly, named on its top, and by how much the animation moves it. */
  function partLabels(glb) {
    const length = new DataView(glb).getUint32(12, true); // of the JSON, which begins at byte 20
    const { meshes, accessors } = JSON.parse(new TextDecoder().decode(new Uint8Array(glb, 20, length)));
    const middle = ({ min, max }) => min.map((one, i) => 0.5 * (one + max[i]));
    const labels = meshes.map(({ name, primitives: [part] }) => ({ text: name.replace(/[ \d]+$/, ""),
      at: middle(accessors[part.attributes.POSITION]).with(1, accessors[part.attributes.POSITION].max[1]), by: middle(accessors[part.targets[0].POSITION]) }));
    return [...d3.group(labels, (label) => label.text).values()].map(([first]) => first);
  }

  const files = await Promise.all(bodies.map((body) => unpacked(body.glb, "model/gltf-binary")));
  const glbs = await Promise.all(files.map((file) => file.arrayBuffer()));
  const addresses = files.map((file) => URL.createObjectURL(file));
  const choice = made("select", {}, ...bodies.map(({ name }, index) => made("option", { value: index, textContent: name })));
  const shown = made("div");
  const caption = made("p", { className: "caption", ariaLive: "polite" });
  place.append(made("label", { className: "choice" }, "Shown ", choice), shown, caption);

  function colourBar({ label, low, high, limit, palette }) {
    const domain = palette.map((_, i) => low + ((high - low) * i) / (palette.length - 1));
    const words = limit === null ? label : `${label}, limit ${digits(limit, 3)}`;
    const bar = Plot.legend({ color: { type: "linear", label: words, domain, range: palette, interpolate: d3.interpolateRgb }, ticks: 5, width: 320, style: { background: "none" } });
    asImage(bar, `Colours from ${digits(low, 3)} to ${digits(high, 3)}: ${words}`);
    return bar;
  }

  function show() {
    const body = bodies[choice.value];
    const viewer = made("model-viewer");
    const attributes = { src: addresses[choice.value], alt: `${body.name}. ${body.caption || ""}`, "camera-controls": "", "interaction-prompt": "none",
      "shadow-intensity": "0.6", "environment-image": "neutral", "animation-name": "motion", "touch-action": "pan-y", exposure: "1.1", "camera-orbit": `25deg 65deg ${body.slider === "apart" ? "130%" : "105%"}` };
    for (const [name, value] of Object.entries(attributes)) viewer.setAttribute(name, value);
    const inMetres = (point) => point.map((entry) => `${entry}m`).join(" ");
    const labels = (body.labels || partLabels(glbs[choice.value])).map(({ text: words, at, by }, i) => {
      const label = made("span", { slot: `hotspot-${i}`, className: "label", textContent: words });
      label.dataset.position = inMetres(at);
      viewer.append(label);
      return { label, at, by };
    });
    const name = body.slider === "press" ? "Press" : "Apart";
    const slider = made("input", { type: "range", min: 0, max: 1, step: "any", value: body.slider === "press" ? 1 : 0, ariaLabel: name });
    const move = () => {
      viewer.currentTime = 0.999 * Number(slider.value);
      for (const { label, at, by } of labels.filter((one) => one.by)) {
        label.hidden = slider.value < 0.3; // together, they would hide each other
        viewer.updateHotspot({ name: label.slot, position: inMetres(at.map((entry, i) => entry + slider.value * by[i])) });
      }
      slider.ariaValueText = `${Math.round(100 * slider.value)} %`;
    };
    viewer.addEventListener("load", () => { viewer.play(); viewer.pause(); move(); });
    slider.addEventListener("input", move);
    shown.replaceChildren(viewer, made("label", { className: "motion" }, `${name} `, slider), ...(body.legend ? [colourBar(body.legend)] : []));
    caption.replaceChildren(body.caption || "", made("span", { className: "help", textContent: " Drag or use the arrow keys to turn, wheel to zoom, two fingers or the right button to move." }));
  }

  choice.addEventListener("change", show);
  show();
}
