"use strict";
/* Shows bodies as GLB in <model-viewer>: one at a time, turned by mouse, finger or arrow keys. */
function showBodies(bodies) {
  const place = document.getElementById("body");
  const choices = document.getElementById("bodies");
  const hint = document.getElementById("body-caption");
  if (bodies.length === 0) return;

  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const addresses = bodies.map((body) => URL.createObjectURL(new Blob([bytes(body.glb)], { type: "model/gltf-binary" })));

  function colourBar({ label, low, high, limit, palette }) {
    return Plot.legend({ color: { type: "linear", label, domain: d3.range(palette.length).map((i) => low + ((high - low) * i) / (palette.length - 1)), range: palette, interpolate: d3.interpolateRgb,
      ticks: 5, ...(limit === null ? {} : { label: `${label}, limit ${Number(limit.toPrecision(3))}` }) }, width: 320, style: { background: "none" } });
  }

  function show(index) {
    const body = bodies[index];
    const viewer = document.createElement("model-viewer");
    const attributes = { src: addresses[index], alt: `${body.name}. ${body.caption || ""}`, "camera-controls": "", "interaction-prompt": "none",
      "shadow-intensity": "0.6", "environment-image": "neutral", "animation-name": "motion", "touch-action": "pan-y", exposure: "1.1", "camera-orbit": `25deg 65deg ${body.slider === "apart" ? "130%" : "105%"}` };
    for (const [name, value] of Object.entries(attributes)) viewer.setAttribute(name, value);
    (body.labels || []).forEach(({ text, at }, i) => {
      const label = document.createElement("button");
      label.slot = `hotspot-${i}`;
      label.dataset.position = at.map((entry) => `${entry}m`).join(" ");
      label.className = "label";
      label.textContent = text;
      viewer.append(label);
    });
    const slider = document.createElement("input");
    Object.assign(slider, { type: "range", min: 0, max: 1, step: "any", value: body.slider === "press" ? 1 : 0 });
    const name = body.slider === "press" ? "Press" : "Apart";
    slider.setAttribute("aria-label", name);
    const move = () => {
      viewer.currentTime = 0.999 * Number(slider.value);
      slider.setAttribute("aria-valuetext", `${Math.round(100 * slider.value)} %`);
    };
    viewer.addEventListener("load", () => { viewer.play(); viewer.pause(); move(); });
    slider.addEventListener("input", move);
    const row = document.createElement("label");
    row.className = "motion";
    row.append(`${name} `, slider);
    place.replaceChildren(viewer, row, ...(body.legend ? [colourBar(body.legend)] : []));
    hint.textContent = body.caption || "Drag to turn, wheel to zoom, two fingers or the right button to move.";
    [...choices.children].forEach((button, i) => button.setAttribute("aria-pressed", String(i === index)));
  }

  bodies.forEach((body, index) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = body.name;
    button.addEventListener("click", () => show(index));
    choices.append(button);
  });
  show(0);
}
