// Whether a certificate is about a model in the format cyclopean.model/1: what `cyclopean verify --model` tells, as far
// as the model's file says it by itself. What it leaves to be found is listed, and not compared.
// SPDX-License-Identifier: MIT. Copyright (c) 2026 The cyclopean authors.
"use strict";

const ROUNDING = 1e-12; // of the largest coordinate, or of the number itself
const LISTED = 10; // differences that are told one by one
const UNITS = { m: 1, cm: 0.01, mm: 0.001, in: 0.0254, ft: 0.3048 };
const COMMAND = "cyclopean verify CERTIFICATE --model MODEL";

// {refused} in one line, or {differences, assumed, open}: what differs, what the model leaves to the certificate, and what
// only the command compares. The certificate has been accepted.
function compareModel(text, modelText) {
  try {
    readJson(modelText); // refuses what JSON.parse lets pass, as a key that occurs twice
    const model = JSON.parse(modelText), unit = model?.units ?? "m", scale = Object.hasOwn(UNITS, unit) ? UNITS[unit] : 0;
    if (model?.schema !== "cyclopean.model/1") throw new BadInput(`it is no cyclopean.model/1, the only format that a page compares; ${COMMAND} reads all`);
    if (!scale) throw new BadInput("its unit is unknown");
    return compared(JSON.parse(text), model, scale);
  } catch (error) {
    if (error instanceof BadInput) return { refused: error.message };
    if (error instanceof TypeError || error instanceof RangeError) return { refused: `it is no sound cyclopean.model/1; ${COMMAND} tells what is wrong` };
    throw error;
  }
}

const away = (r, s) => Math.hypot(...sub(r, s)), near = (x, y) => Math.abs(x - y) <= ROUNDING * Math.abs(y);

function compared(proof, model, scale) {
  const stones = new Map(proof.blocks.map((stone) => [stone.id, stone])), open = [];
  const metres = (r) => r.map((x) => {
    if (!Number.isFinite(x)) throw new TypeError("no number"); // JavaScript would take "" or null for 0
    return x * scale;
  });
  const blocks = model.blocks.map((block) => ({ ...block, vertices: block.vertices.map(metres) }));
  const held = new Map((model.supports ?? []).map((one) => [one.block, one.held]));
  const named = blocks.some((block) => block.fixed) || held.size > 0;
  if (!named) open.push("supports: the model names none");
  const largest = [...blocks, ...proof.blocks].flatMap((block) => block.vertices).reduce((x, r) => Math.max(x, ...r.map(Math.abs)), 0);
  const same = (distance) => distance <= ROUNDING * largest;
  const ids = new Set(blocks.map((block) => block.id));
  if (ids.size !== blocks.length) throw new TypeError("two blocks have the same id");
  const told = proof.blocks.filter(({ id }) => !ids.has(id)).map(({ id }) => `block ${quoted(id)} is only in the certificate`);
  for (const block of blocks) {
    const stone = stones.get(block.id), name = `block ${quoted(block.id)}`;
    if (stone) told.push(...changes2(stone, block, named, held.get(block.id) ?? [], same).map((what) => `${name} ${what}`));
    else told.push(`${name} is missing in the certificate`);
  }
  const assumed = [`gravity (${proof.gravity.map(short).join(", ")})`];
  const light = new Set(blocks.filter((block) => (block.density ?? null) === null).map((block) => block.id));
  const densities = proof.blocks.filter((stone) => !stone.fixed && light.has(stone.id)).map((stone) => stone.density);
  if (densities.length) assumed.push(`density ${span(densities)}`);
  if (proof.live) assumed.push("what grows with the multiplier");
  if (model.contacts) told.push(...jointsApart(proof, model, metres, same, stones, assumed, open));
  else open.push("contacts and their friction: the model lists none, they are found where its blocks touch");
  told.push(...loadsApart(proof, model, metres, same, open), ...settledApart(proof, model, metres));
  const more = told.length > LISTED ? [`and ${told.length - LISTED} more differences`] : [];
  return { differences: [...told.slice(0, LISTED), ...more], assumed, open };
}

function changes2(stone, block, named, held, same) {
  const told = [], there = stone.vertices, rings = (faces) => faces.map((face) => {
    const first = face.indexOf(Math.min(...face));
    return [...face.slice(first), ...face.slice(0, first)].join();
  }).sort().join(" ");
  const apart = there.length === block.vertices.length ? there.reduce((x, r, i) => Math.max(x, away(r, block.vertices[i])), 0) : null;
  if (apart === null) told.push(`has ${there.length} vertices, in the model ${block.vertices.length}`);
  else if (!same(apart)) told.push(`has vertices up to ${rounded(apart, 3)} m from those of the model`);
  if (apart !== null && rings(stone.faces) !== rings(block.faces)) told.push("has other faces than in the model");
  if ((block.density ?? null) !== null && !near(stone.density, block.density)) told.push(`has ${decimal(stone.density)} kg/m3, in the model ${decimal(block.density)}`);
  if (!named) return told;
  if (stone.fixed !== (block.fixed === true)) told.push(stone.fixed ? "is a support, in the model it is free" : "is free, in the model it is a support");
  else if (AXES.filter((axis) => held.includes(axis)).join() !== (stone.held ?? []).join()) told.push("is held along other axes than in the model");
  return told;
}

function jointsApart(proof, model, metres, same, stones, assumed, open) {
  const unit = (n) => n && n.map((x) => x / Math.hypot(...n));
  const joint = (row, polygon) => {
    const way = row.a < row.b ? 1 : -1, facing = unit(row.normal) ?? [0, 0, 0];
    return { ...row, pair: [row.a, row.b].sort().join("\0"), polygon: way > 0 ? polygon : [...polygon].reverse(), facing: times(facing, way), name: `contact of ${quoted(row.a)} and ${quoted(row.b)}` };
  };
  const bears = ({ a, b }) => !(stones.get(a)?.fixed && stones.get(b)?.fixed);
  const here = model.contacts.map((row) => joint(row, row.polygon.map(metres))).filter(bears), told = [], pairs = [];
  const there = new Map(); // by their blocks
  for (const row of proof.contacts.map((row) => joint(row, row.polygon))) there.set(row.pair, [...(there.get(row.pair) ?? []), row]);
  const alone = here.filter((one) => {
    const others = there.get(one.pair) ?? [], k = others.findIndex((other) => same(polygonsApart(one.polygon, other.polygon)));
    if (k >= 0) pairs.push([one, ...others.splice(k, 1)]);
    return k < 0;
  });
  for (const one of alone) {
    const other = there.get(one.pair)?.shift();
    told.push(other ? `${one.name} has its corners up to ${rounded(polygonsApart(one.polygon, other.polygon), 3)} m from those in the model` : `${one.name} is missing in the certificate`);
    if (other) pairs.push([one, other]);
  }
  told.push(...[...there.values()].flat().map((other) => `${other.name} is only in the certificate`));
  for (const [one, other] of pairs) {
    const more = other.mu - one.mu, harder = (/^(rbe|cra)-state$/.test(proof.kind) && more < 0) || (/^(rbe-mechanism|cra-tree)$/.test(proof.kind) && more > 0);
    if (away(one.facing, other.facing) > ROUNDING) told.push(`${one.name} faces another way than in the model`);
    if ((one.mu ?? null) !== null && !near(other.mu, one.mu) && !harder) told.push(`${one.name} has mu ${decimal(other.mu)}, in the model ${decimal(one.mu)}`);
    if ((one.tension ?? null) !== null && !near(other.tension ?? 0, one.tension)) told.push(`${one.name} pulls with ${decimal(other.tension ?? 0)} Pa, in the model ${decimal(one.tension)}`);
  }
  const without = pairs.filter(([one]) => (one.mu ?? null) === null).map(([, other]) => other.mu);
  if (without.length && model.friction?.length) open.push("friction, which the model gives by materials");
  else if (without.length) assumed.push(`mu ${span(without)}`);
  if (pairs.some(([one, other]) => (one.tension ?? null) === null && other.tension)) assumed.push("JOINTS THAT PULL");
  if (proof.contacts.some((row) => row.edges)) assumed.push("PYRAMIDS for friction cones");
  return told;
}

function polygonsApart(p, q) { // how far corners are apart at most: one by one round both, or each from the nearest
  const far = (from, to) => Math.max(...from.map((r) => Math.min(...to.map((s) => away(r, s)))));
  if (p.length !== q.length) return Math.max(far(p, q), far(q, p));
  return Math.min(...q.map((_, k) => Math.max(...p.map((r, i) => away(r, q[(i + k) % q.length])))));
}

function loadsApart(proof, model, metres, same, open) {
  const given = model.loads ?? [], words = ({ block, force, point }) => `the load (${force.map(short).join(", ")}) N on block ${quoted(block)} at (${point.map(short).join(", ")})`;
  if (given.some((load) => !load.force || !load.point)) {
    open.push("loads, some of which the model gives by areas, volumes or at a centre of mass");
    return [];
  }
  const acts = ({ force }) => force.some((x) => x !== 0), left = proof.loads.filter(acts), told = [];
  const room = ROUNDING * given.reduce((x, { force }) => Math.max(x, Math.hypot(...force)), 0);
  for (const load of given.map((one) => ({ ...one, point: metres(one.point) })).filter(acts)) {
    const k = left.findIndex((row) => row.block === load.block && away(row.force, load.force) <= room && same(away(row.point, load.point)));
    if (k < 0) told.push(`${words(load)} is missing in the certificate`);
    else left.splice(k, 1);
  }
  return [...told, ...left.map((row) => `${words(row)} is only in the certificate`)];
}

function settledApart(proof, model, metres) {
  if (proof.kind !== "rbe-settled" || !model.settlements?.length) return [];
  const there = new Map(Object.entries(proof.settlements)), here = new Map(model.settlements.map(({ block, motion }) => [block, [...metres(motion.slice(0, 3)), ...motion.slice(3)]]));
  const still = [0, 0, 0, 0, 0, 0];
  return [...new Set([...here.keys(), ...there.keys()])].filter((id) => {
    const [said, found] = [here.get(id) ?? still, there.get(id) ?? still];
    return !(Math.hypot(...said.map((x, k) => x - found[k])) <= ROUNDING * Math.hypot(...said));
  }).map((id) => `block ${quoted(id)} settles in another way than in the model`);
}
