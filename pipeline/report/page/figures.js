"use strict";
/* What every page has: its data, words for numbers, plots that say what they lack, and buttons that copy. */
const data = JSON.parse(document.getElementById("data").textContent);
const [PASSED, FAILED, UNDECIDED] = document.body.dataset.outcomes.split(" ");
const colours = d3.range(1, 8).map((number) => `var(--c${number})`);
const element = (id) => document.getElementById(id);
const digits = (value, count = 4) => String(Math.abs(value) < 1e-9 ? 0 : Number(Number(value).toPrecision(count)));
const text = (value, unit = "") => (Number.isFinite(value) ? `${digits(value)}${unit && ` ${unit}`}` : "none");
/* An error, with two digits. */
const ofError = (value, unit) => text(Number.isFinite(value) ? Number(digits(value, 2)) : NaN, unit);
const percent = (value) => `${digits(100 * value, 3)} %`;
const last = (values) => values[values.length - 1];
const here = (marks) => marks.filter((mark) => mark !== null);

/* Say what a plot lacks; its numbers are in the files beside the page all the same. */
function need(found, reason) {
  if (!found) throw new Error(reason);
  return found;
}

function made(kind, properties = {}, ...children) {
  const one = Object.assign(document.createElement(kind), properties);
  one.append(...children);
  return one;
}

/* What Python has packed, as a file of a kind. */
function unpacked(text, type) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream, { headers: { "Content-Type": type } }).blob();
}

/* One image with one name for those who hear it: names of its marks say nothing. */
function asImage(svg, words) {
  for (const group of svg.querySelectorAll("[aria-label]")) group.removeAttribute("aria-label");
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", words);
}

/* Plots, each a title and a function that returns the options of Plot.plot with a caption, and `ready`, which is given
   the drawing. Returns a function that draws all of them, and again. A plot that cannot be drawn is not shown; one line
   below the others says which and why. */
function drawPlots(plots, place) {
  const figures = plots.map(([title, spec]) => {
    const drawing = made("div");
    const caption = made("figcaption");
    const figure = made("figure", {}, made("h3", { textContent: title }), drawing, caption);
    place.append(figure);
    return { title, spec, figure, drawing, caption };
  });
  const left = made("p", { className: "caption" });
  place.after(left);

  /* Draw one plot; returns why it cannot be drawn, or nothing. */
  function draw({ title, spec, figure, drawing, caption }) {
    figure.hidden = false;
    try {
      const { caption: words, ready, ...options } = spec();
      const drawn = Plot.plot({ width: Math.min(560, drawing.clientWidth || 560), height: 340, grid: true, inset: 4,
        marginBottom: 46, marginTop: 28, style: { background: "none", fontSize: "12px" }, ...options });
      const svg = drawn.tagName === "svg" ? drawn : drawn.querySelector(":scope > svg:last-of-type");
      asImage(svg, `${title}. ${words}`);
      drawing.replaceChildren(drawn);
      caption.textContent = words;
      if (ready) ready(drawn, svg);
      return [];
    } catch (error) {
      figure.hidden = true;
      return [`${title} (${error.message})`];
    }
  }

  return () => {
    const reasons = figures.flatMap(draw);
    left.textContent = reasons.length ? `Not drawn: ${reasons.join("; ")}.` : "";
  };
}

function copyButton(words) {
  const button = made("button", { type: "button", textContent: "Copy" });
  button.dataset.copy = words;
  return button;
}

document.addEventListener("click", async ({ target }) => {
  if (!target.matches("button[data-copy]")) return;
  await navigator.clipboard.writeText(target.dataset.copy);
  target.textContent = "Copied";
  element("copied").textContent = `Copied: ${target.dataset.copy}`;
});
window.addEventListener("beforeprint", () => {
  for (const one of document.querySelectorAll("details:not(.digests)")) one.open = true;
});
