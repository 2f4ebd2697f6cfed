"use strict";
/* What stands in for the viewer of bodies where WebGL is missing: a picture from one side, the nearest body in each pixel. */
function treeOf(glb) {
  const length = new DataView(glb).getUint32(12, true); // of the JSON, which begins at byte 20; 8 bytes before the numbers
  return { ...JSON.parse(new TextDecoder().decode(new Uint8Array(glb, 20, length))), begin: 28 + length };
}

const along = (axis, point) => axis[0] * point[0] + axis[1] * point[1] + axis[2] * point[2];

/* The directions to the right, up and towards who looks, as the viewer begins. */
function firstView() {
  const [round, down] = [25, 65].map((angle) => (angle * Math.PI) / 180);
  return {
    right: [Math.cos(round), 0, -Math.sin(round)],
    up: [-Math.sin(round) * Math.cos(down), Math.sin(down), -Math.cos(round) * Math.cos(down)],
    towards: [Math.sin(round) * Math.sin(down), Math.cos(down), Math.cos(round) * Math.sin(down)],
  };
}

function stillOf(glb, alt) {
  const [width, height] = [1120, 790];
  const { right, up, towards } = firstView();

  const { meshes, accessors, bufferViews, begin } = treeOf(glb);
  function numbers(index, kind, each) {
    const { bufferView, byteOffset = 0, count } = accessors[index];
    return new kind(glb, begin + bufferViews[bufferView].byteOffset + byteOffset, count * each);
  }
  const parts = meshes.map(({ primitives: [part] }) => ({ corners: numbers(part.indices, Uint32Array, 1), colours: numbers(part.attributes.COLOR_0, Uint8Array, 4),
    at: numbers(part.attributes.POSITION, Float32Array, 3), by: numbers(part.targets[0].POSITION, Float32Array, 3) }));
  const pointOf = ({ at, by }, i, moved) => [0, 1, 2].map((k) => at[3 * i + k] + moved * by[3 * i + k]);

  /* The frame holds the bodies together and apart, so that they keep their size. */
  const points = parts.flatMap((part) => d3.range(part.at.length / 3).flatMap((i) => [pointOf(part, i, 0), pointOf(part, i, 1)]));
  const [across, high] = [right, up].map((axis) => d3.extent(points, (point) => along(axis, point)));
  const scale = 0.9 * Math.min(width / (across[1] - across[0]), height / (high[1] - high[0]));
  const seen = (point) => [0.5 * width + scale * (along(right, point) - d3.mean(across)), 0.5 * height - scale * (along(up, point) - d3.mean(high)), scale * along(towards, point)];

  const canvas = made("canvas", { width, height, ariaLabel: alt, role: "img" });
  const context = canvas.getContext("2d");

  function fill(image, nearest, corners, colours) {
    const [a, b, c] = corners;
    const [one, other] = [b, c].map((corner) => corner.map((entry, k) => entry - a[k]));
    const area = one[0] * other[1] - one[1] * other[0];
    const normal = [one[1] * other[2] - one[2] * other[1], one[2] * other[0] - one[0] * other[2], area];
    const light = 0.3 + (0.7 * Math.abs(along([-0.3, -0.5, 0.81], normal))) / Math.hypot(...normal);
    const shades = colours.map((colour) => colour.map((entry) => 255 * ((light * entry) / 255) ** (1 / 2.2))); // linear to that of a screen
    const [left, top] = [0, 1].map((k) => Math.max(0, Math.floor(Math.min(a[k], b[k], c[k]))));
    const [end, bottom] = [width, height].map((most, k) => Math.min(most - 1, Math.ceil(Math.max(a[k], b[k], c[k]))));
    for (let y = top; y <= bottom; y += 1) {
      for (let x = left; x <= end; x += 1) {
        const v = ((x - a[0]) * other[1] - (y - a[1]) * other[0]) / area;
        const w = (one[0] * (y - a[1]) - one[1] * (x - a[0])) / area;
        const depth = a[2] + v * one[2] + w * other[2];
        const pixel = y * width + x;
        if (v >= 0 && w >= 0 && v + w <= 1 && depth > nearest[pixel]) {
          nearest[pixel] = depth;
          for (let k = 0; k < 3; k += 1) image.data[4 * pixel + k] = (1 - v - w) * shades[0][k] + v * shades[1][k] + w * shades[2][k];
          image.data[4 * pixel + 3] = 255;
        }
      }
    }
  }

  function draw(moved) {
    const image = context.createImageData(width, height);
    const nearest = new Float32Array(width * height).fill(-Infinity);
    for (const part of parts) {
      const places = d3.range(part.at.length / 3).map((i) => seen(pointOf(part, i, moved)));
      for (let k = 0; k < part.corners.length; k += 3) {
        const corners = [...part.corners.subarray(k, k + 3)];
        fill(image, nearest, corners.map((i) => places[i]), corners.map((i) => [...part.colours.subarray(4 * i, 4 * i + 3)]));
      }
    }
    context.putImageData(image, 0, 0);
  }

  const placeOf = (point) => [100 * seen(point)[0] / width, 100 * seen(point)[1] / height]; // [%] of the picture
  return { canvas, draw, placeOf };
}
