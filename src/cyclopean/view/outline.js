// What a page draws of a certificate: its blocks from the front and above, with the joint or block that fails marked.
// SPDX-License-Identifier: MIT. Copyright (c) 2026 The cyclopean authors.
"use strict";

const MOST_FACES = 20000; // that a page draws without halting
const [ROUND, RISE] = [Math.PI / 6, Math.PI / 7]; // from how far beside the front, and how high, it is seen
const RIGHT = [Math.cos(ROUND), -Math.sin(ROUND), 0];
const UP = [Math.sin(ROUND) * Math.sin(RISE), Math.cos(ROUND) * Math.sin(RISE), Math.cos(RISE)];
const EYE = cross(RIGHT, UP);

// Shapes from the furthest to the nearest, {points, mark}, mark "" or "by" or "fails", and the box of the picture; null
// where there is nothing that can be drawn. Of what a file holds only numbers come out.
function outlineOf(text, where) {
  try {
    const { blocks, contacts } = JSON.parse(text), joint = where?.contact === undefined ? null : contacts[where.contact];
    const seen = (r) => {
      const at = [dot(r, RIGHT), -dot(r, UP)];
      if (!at.every(Number.isFinite)) throw new RangeError("a place is no number");
      return at;
    };
    const mark = ({ id }) => (where?.block === id ? "fails" : joint && (joint.a === id || joint.b === id) ? "by" : "");
    const faces = blocks.flatMap((block) => block.faces.map((face) => ({ corners: face.map((i) => block.vertices[i]), mark: mark(block) })));
    if (faces.length > MOST_FACES) return null;
    const shapes = faces.map(({ corners, mark }) => ({ points: corners.map(seen), mark, depth: dot(corners.reduce(add), EYE) / corners.length }))
      .filter(({ points }) => points.reduce((sum, p, i) => sum + turn2(points[0], p, points[(i + 1) % points.length]), 0) < 0) // y points down
      .sort((x, y) => x.depth - y.depth);
    const [low, high] = [Math.min, Math.max].map((of) => [0, 1].map((k) => shapes.reduce((x, { points }) => of(x, ...points.map((p) => p[k])), shapes[0].points[0][k])));
    if (joint) shapes.push({ points: joint.polygon.map(seen), mark: "fails" });
    const scale = 1000 / Math.max(high[0] - low[0], high[1] - low[1]); // as wide, or as high, as that many units
    const place = (p) => p.map((x, k) => ((x - low[k]) * scale).toFixed(1)).join();
    const spot = joint && where.point !== undefined && joint.polygon[where.point] ? place(seen(joint.polygon[where.point])).split(",") : null;
    return { shapes: shapes.map(({ points, mark }) => ({ points: points.map(place).join(" "), mark })), size: [0, 1].map((k) => ((high[k] - low[k]) * scale).toFixed(0)), spot };
  } catch {
    return null; // a file that is no certificate has no outline
  }
}
