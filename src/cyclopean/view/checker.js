// Checks certificates (cyclopean.certificate/2) as docs/certificates.md states the rules, and shares nothing else with
// src/cyclopean/proof/checker.py. One file, no dependency: runs in a worker, in a page and in node.
// SPDX-License-Identifier: MIT. Copyright (c) 2026 The cyclopean authors.
//
// verifyCertificate(text, progress) -> {proved, kind, claim, reason, where, assumed}
//
// How exactness is kept. Every double is m 2^e. Lengths, forces and motions are counted in units of their own, powers of
// two so small that all of a file's numbers are whole; forces in a 24th of theirs, so that weights and their moments are
// whole too. From there on everything is BigInt. Only roots are rounded: to 2^-128 units, to the side that hurts the claim.
"use strict";

const BALANCE = 10n ** 9n; // one over
const BOUND = 10n ** 6n;
const COUPLING = 10n ** 9n; // one over
const SHORT = 1000n;
const SETTLING = 10n ** 7n; // one over
const TINY = 1e-150, HUGE = 1e100;
const STEEP = 5, SLIPPERY = 2, ROUNDED_MU = 1e-9;
const MAX_DEPTH = 250, MAX_NODES = 1000000;
const LARGEST = 1 << 30;
const GUARD = 128n, UNIT = 1n << GUARD; // bits behind the unit that roots and quotients keep
const FAMILY = "cyclopean.certificate/", SCHEMA = FAMILY + "2";
const TOLD_LEAN = 1e-4, TOLD_SHARE = 1e-5; // from which the claim tells how badly contacts fit
const MAX_CONVEX = 4000, MAX_PAIRS = 100000, MAX_PROJECTED = 4e6; // how far it is looked for overlaps
const AXES = ["x", "y", "z", "rx", "ry", "rz"];

class BadInput extends Error {}
class NotProved extends Error {
  constructor(reason, where = null) {
    super(reason);
    this.where = where;
  }
}

function demand(holds, reason, where) {
  if (!holds) throw new NotProved(typeof reason === "function" ? reason() : reason, where);
}

// ---- Whole vectors and roots

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times = (a, k) => [a[0] * k, a[1] * k, a[2] * k];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const square = (a) => dot(a, a);
const isZero = (a) => a.every((x) => x === 0n);
const size = (x) => (x < 0n ? -x : x);
const least = (a, b) => (a < b ? a : b);
const most = (a, b) => (a > b ? a : b);
const ZERO = [0n, 0n, 0n];

function floorDiv(a, b) { // b > 0
  const q = a / b;
  return a < 0n && q * b !== a ? q - 1n : q;
}
const ceilDiv = (a, b) => -floorDiv(-a, b);

function isqrt(n) {
  if (n < 2n) return n;
  const drop = BigInt(Math.max(0, n.toString(16).length * 4 - 900) & ~1); // what is left is a double
  let x = (BigInt(Math.ceil(Math.sqrt(Number(n >> drop)) * (1 + 1e-14))) + 1n) << (drop / 2n); // above the root
  for (;;) { // Newton: the iterates fall down to the root
    const y = (x + n / x) >> 1n;
    if (y >= x) return x;
    x = y;
  }
}
// Roots of whole numbers, in units of 2^-128.
const rootDown = (n) => isqrt(n << (2n * GUARD));
const rootUp = (n) => ceilRoot(n << (2n * GUARD));
const ceilRoot = (n) => (n === 0n ? 0n : isqrt(n - 1n) + 1n);
const sidesOf = (points) => points.map((r, i) => sub(points[(i + 1) % points.length], r));
const perimeterUp = (points) => sidesOf(points).reduce((sum, e) => sum + rootUp(square(e)), 0n);
const boxOf = (points) => [least, most].map((of) => points.reduce((corner, r) => corner.map((x, k) => of(x, r[k]))));

function ratio(n, d) { // n / d as a double, d > 0: for what is only told
  const shift = 4 * (d.toString(16).length - n.toString(16).length) + 80;
  return Number(shift > 0 ? (n << BigInt(shift)) / d : n / (d << BigInt(-shift))) * 2 ** -shift;
}

// ---- The file: JSON that keeps how numbers are written, and its seal

class Written { // a number, as the file writes it
  constructor(text) {
    this.text = text;
  }
  get whole() {
    return /^-?\d+$/.test(this.text);
  }
}

function readJson(text) {
  const token = /[ \t\n\r]*(?:([{}[\],:])|("[^"\\\u0000-\u001f]*(?:\\.[^"\\\u0000-\u001f]*)*")|(-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?)|(true|false|null|NaN|-?Infinity))/y;
  let found = null;
  const wrong = () => { throw new BadInput(`no JSON: character ${token.lastIndex || text.length}`); };
  const next = () => {
    const at = token.lastIndex;
    found = token.exec(text);
    if (!found) throw new BadInput(`no JSON from character ${at + 1} on`);
  };
  const string = () => {
    if (found[2] === undefined) wrong();
    if (!found[2].includes("\\")) return found[2].slice(1, -1);
    try {
      return JSON.parse(found[2]);
    } catch {
      return wrong();
    }
  };
  const items = (close, one) => { // one by one, from an opening bracket to its closing one
    for (next(); found[1] !== close; ) {
      one();
      next();
      if (found[1] === close) return;
      if (found[1] !== ",") wrong();
      next();
      if (found[1] === close) wrong();
    }
  };
  const value = () => { // of the token at hand
    if (found[2] !== undefined) return string();
    const word = found[3] ?? found[4];
    if (word !== undefined) return ["true", "false", "null"].includes(word) ? JSON.parse(word) : new Written(word);
    if (found[1] === "[") {
      const list = [];
      items("]", () => list.push(value()));
      return list;
    }
    if (found[1] !== "{") wrong();
    const map = new Map();
    items("}", () => {
      const key = string();
      if (map.has(key)) throw new BadInput(`key ${quoted(key)} occurs twice in an object`);
      next();
      if (found[1] !== ":") wrong();
      next();
      map.set(key, value());
    });
    return map;
  };
  try {
    next();
    const all = value();
    if (/[^ \t\n\r]/.test(text.slice(token.lastIndex, token.lastIndex + 1000))) wrong();
    return all;
  } catch (error) {
    if (error instanceof RangeError) throw new BadInput("no certificate: nested too deeply");
    throw error;
  }
}

const jointName = ({ blocks }, { k, a, b }) => `contact ${k} of ${quoted(blocks[a].id)} and ${quoted(blocks[b].id)}`;
const quoted = (text) => `'${shown(text)}'`;

function shown(text) { // a name on one line of plain ASCII, as the page has it
  const some = [...text].slice(0, 61), mark = some.includes("'") && !some.includes('"') ? '"' : "'";
  const hex = (c, letter, digits) => `\\${letter}${c.codePointAt(0).toString(16).padStart(digits, "0")}`;
  const plain = some.map((c) => {
    if (c === mark || "\\\n\r\t".includes(c)) return { "\n": "\\n", "\r": "\\r", "\t": "\\t" }[c] ?? `\\${c}`;
    if (c >= " " && c <= "~") return c;
    return c <= "\xff" ? hex(c, "x", 2) : c.length === 1 ? hex(c, "u", 4) : hex(c, "U", 8);
  }).join("");
  return plain.length > 60 ? `${plain.slice(0, 57)}...` : plain;
}

function byCodePoints(a, b) {
  const [p, q] = [a, b].map((text) => Array.from(text, (c) => c.codePointAt(0))), k = p.findIndex((x, i) => x !== q[i]);
  return k < 0 ? p.length - q.length : p[k] - (q[k] ?? -1);
}

const ESCAPES = { '"': '\\"', "\\": "\\\\", "\n": "\\n", "\r": "\\r", "\t": "\\t", "\b": "\\b", "\f": "\\f" };
const stringText = (text) =>
  `"${text.replace(/["\\]|[^ -~]/g, (c) => ESCAPES[c] ?? `\\u${c.charCodeAt(0).toString(16).padStart(4, "0")}`)}"`;

function doubleText(x) { // shortest that reads back, as the page has it
  if (x === 0) return Object.is(x, -0) ? "-0.0" : "0.0";
  if (!Number.isFinite(x)) return String(x);
  const [, sign, lead, rest = "", power] = /^(-?)(\d)(?:\.(\d+))?e([+-]\d+)$/.exec(x.toExponential());
  const digits = lead + rest, e = Number(power);
  if (e < -4 || e >= 16) {
    return `${sign}${lead}${rest && "."}${rest}e${e < 0 ? "-" : "+"}${String(Math.abs(e)).padStart(2, "0")}`;
  }
  if (e < 0) return `${sign}0.${"0".repeat(-e - 1)}${digits}`;
  if (digits.length <= e + 1) return `${sign}${digits}${"0".repeat(e + 1 - digits.length)}.0`;
  return `${sign}${digits.slice(0, e + 1)}.${digits.slice(e + 1)}`;
}

function canonical(value) {
  if (value instanceof Written) return value.whole ? String(BigInt(value.text)) : doubleText(Number(value.text));
  if (typeof value === "string") return stringText(value);
  if (Array.isArray(value)) return `[${value.map(canonical).join(",")}]`;
  if (!(value instanceof Map)) return String(value);
  const keys = [...value.keys()].sort(byCodePoints);
  return `{${keys.map((key) => `${stringText(key)}:${canonical(value.get(key))}`).join(",")}}`;
}

function sha256(text) { // FIPS 180-4; of the text in UTF-8
  const bytes = new TextEncoder().encode(text);
  const primes = [];
  for (let n = 2; primes.length < 64; n++) if (primes.every((p) => n % p)) primes.push(n);
  const digits = (root) => ((root - Math.floor(root)) * 2 ** 32) | 0; // the first 32 bits behind the point
  const k = primes.map((p) => digits(Math.cbrt(p))), h = primes.slice(0, 8).map((p) => digits(Math.sqrt(p)));
  const padded = new Uint8Array(((bytes.length + 72) >> 6) << 6);
  padded.set(bytes);
  padded[bytes.length] = 128;
  const view = new DataView(padded.buffer), w = new Int32Array(64);
  view.setUint32(padded.length - 8, Math.floor(bytes.length / 2 ** 29));
  view.setUint32(padded.length - 4, (bytes.length << 3) >>> 0);
  const turn = (x, n) => (x >>> n) | (x << (32 - n));
  for (let at = 0; at < padded.length; at += 64) {
    for (let i = 0; i < 64; i++) {
      if (i < 16) { w[i] = view.getInt32(at + 4 * i); continue; }
      const x = w[i - 15], y = w[i - 2];
      w[i] = w[i - 16] + w[i - 7] + (turn(x, 7) ^ turn(x, 18) ^ (x >>> 3)) + (turn(y, 17) ^ turn(y, 19) ^ (y >>> 10));
    }
    let [a, b, c, d, e, f, g, l] = h;
    for (let i = 0; i < 64; i++) {
      const s = (l + (turn(e, 6) ^ turn(e, 11) ^ turn(e, 25)) + ((e & f) ^ (~e & g)) + k[i] + w[i]) | 0;
      const t = ((turn(a, 2) ^ turn(a, 13) ^ turn(a, 22)) + ((a & b) ^ (a & c) ^ (b & c))) | 0;
      [l, g, f, e, d, c, b, a] = [g, f, e, (d + s) | 0, c, b, a, (s + t) | 0];
    }
    [a, b, c, d, e, f, g, l].forEach((x, i) => { h[i] = (h[i] + x) | 0; });
  }
  return h.map((x) => (x >>> 0).toString(16).padStart(8, "0")).join("");
}

function sealed(text, root) {
  const seal = root.get("seal");
  if (sha256(text.replace(/[\r\n]/g, "").replace(/,"seal":"[^"]*"/, "")) === seal) return true;
  return sha256(canonical(new Map([...root].filter(([key]) => key !== "seal")))) === seal;
}

// ---- Form: keys, types, names, counts, sizes of numbers. What comes out is made of doubles

const FREE_FORM = ["schema", "kind", "gravity", "tolerance", "blocks", "contacts", "loads", "seal"];
const COUPLED = ["eps", "eta", "beta_min"];
const KEYS = {
  "rbe-state": [["forces"]],
  "rbe-mechanism": [["mechanism"]],
  "cra-state": [["forces", "mechanism", ...COUPLED]],
  "cra-tree": [["tree", ...COUPLED], ["component"]],
  "limit-bounds": [["live"], ["lower", "forces", "upper", "mechanism", "recession"]],
  "rbe-settled": [["forces", "mechanism", "settlements"]],
  "rbe-state-within": [["forces", "within", "points", "ways"]],
  "rbe-mechanism-within": [["motions", "within"]],
};

function record(value, must, may, what) {
  demand(value instanceof Map, `${what} is not an object`);
  for (const key of must) demand(value.has(key), () => `${what} lacks ${quoted(key)}`);
  for (const key of value.keys()) demand(must.includes(key) || may.includes(key), () => `${what} has an unknown key ${quoted(key)}`);
  return value;
}

function list(value, what) {
  demand(Array.isArray(value), () => `${what} is not a list`);
  return value;
}

function number(value, what) {
  demand(value instanceof Written, () => `${what} is not a number`);
  const x = Number(value.text);
  demand(x === 0 || (Math.abs(x) >= TINY && Math.abs(x) <= HUGE), () => `${what} is ${value.text.slice(0, 30)}: neither 0 nor from 1e-150 to 1e100 in size`);
  if (value.whole) demand(BigInt(value.text) === BigInt(x), () => `${what} is ${value.text.slice(0, 30)}, which no double holds`);
  return x;
}

function numbers(value, count, what) {
  demand(list(value, what).length === count, () => `${what} is not made of ${count} numbers`);
  return value.map((x) => number(x, what));
}

function positive(value, what) {
  const x = number(value, what);
  demand(x > 0, () => `${what} is not more than 0`);
  return x;
}

function whole(value, below, what) {
  demand(value instanceof Written && value.whole, () => `${what} is not a whole number`);
  const x = Number(value.text);
  demand(x >= 0 && x < below, () => `${what} is ${value.text.slice(0, 30)}: there is no such`);
  return x;
}

function readBlock(value, k) {
  const what = `block ${k}`;
  record(value, ["id", "vertices", "faces", "density", "fixed"], ["held"], what);
  const id = value.get("id"), fixed = value.get("fixed");
  demand(typeof id === "string", `${what}: its id is not text`);
  const told = `block ${quoted(id)}`, where = { block: id };
  demand(fixed === true || fixed === false, `${told}: fixed is neither true nor false`, where);
  const vertices = list(value.get("vertices"), `vertices of ${told}`).map((v) => numbers(v, 3, `a vertex of ${told}`));
  const faces = list(value.get("faces"), `faces of ${told}`).map((face) => {
    const corners = list(face, `a face of ${told}`).map((i) => whole(i, vertices.length, `a corner of a face of ${told}`));
    demand(corners.length > 2 && new Set(corners).size === corners.length, `${told}: a face has not three or more different corners`, where);
    return corners;
  });
  const density = number(value.get("density"), `density of ${told}`);
  demand(fixed ? density >= 0 : density > 0, `${told}: its density is not more than 0`, where);
  let held = [];
  if (value.has("held")) {
    held = list(value.get("held"), `what holds ${told}`);
    const order = held.map((x) => AXES.indexOf(x));
    demand(!fixed && held.length > 0 && held.length < 6 && order.every((x, i) => x > (i ? order[i - 1] : -1)), `${told}: held does not list some of x, y, z, rx, ry, rz in that order`, where);
  }
  return { id, vertices, faces, density, fixed, held: AXES.map((axis) => held.includes(axis)), partly: held.length > 0 };
}

function readContact(value, k, index, blocks, kind) {
  const what = `contact ${k}`, where = { contact: k };
  record(value, ["a", "b", "polygon", "mu"], ["tension", "surface", "normal", "edges"], what);
  const [a, b] = ["a", "b"].map((side) => {
    const name = value.get(side);
    demand(typeof name === "string" && index.has(name), () => `${what} names a block that is not there`, where);
    return index.get(name);
  });
  demand(a !== b, `${what} joins a block with itself`, where);
  demand(!(blocks[a].fixed && blocks[b].fixed), `${what} is between two supports`, where);
  const surface = value.has("surface") ? value.get("surface") : "flat";
  demand(!value.has("surface") || ["rough", "curved", "point"].includes(surface), `${what} has an unknown surface`, where);
  const polygon = list(value.get("polygon"), `polygon of ${what}`).map((p) => numbers(p, 3, `a corner of ${what}`));
  demand(surface === "point" ? polygon.length === 1 : polygon.length >= 3, `${what} has ${polygon.length} corners`, where);
  demand((surface === "point") === value.has("normal"), `${what}: a normal belongs to points, and to them alone`, where);
  const mu = number(value.get("mu"), `mu of ${what}`);
  demand(mu >= 0, `${what}: mu is negative`, where);
  const contact = { a, b, polygon, mu, surface, k, normal: null, tension: 0, edges: null };
  if (value.has("normal")) contact.normal = numbers(value.get("normal"), 3, `normal of ${what}`);
  if (value.has("tension")) {
    contact.tension = positive(value.get("tension"), `tension of ${what}`);
    demand(surface !== "point" && ["rbe-state", "rbe-mechanism", "limit-bounds"].includes(kind), `${what}: tension is not known here`, where);
  }
  if (value.has("edges")) {
    const edges = list(value.get("edges"), `edges of ${what}`);
    demand(edges.length >= 3 && edges.length <= 360, `${what} has not 3 to 360 edges`, where);
    contact.edges = edges.map((e) => numbers(e, 3, `an edge of ${what}`));
    demand(["rbe-state", "rbe-mechanism"].includes(kind) && !contact.tension && ["flat", "point"].includes(surface), `${what}: edges are not known here`, where);
  }
  if (kind.endsWith("within")) demand(surface === "flat" || surface === "point", `${what}: rough and curved surfaces are not known in this kind`, where);
  return contact;
}

function readLoads(value, index) {
  return list(value, "loads").map((load, k) => {
    record(load, ["block", "force", "point"], [], `load ${k}`);
    demand(index.has(load.get("block")), `load ${k} acts on a block that is not there`);
    return { block: index.get(load.get("block")), force: numbers(load.get("force"), 3, `load ${k}`), point: numbers(load.get("point"), 3, `point of load ${k}`) };
  });
}

// Rows of forces: for each contact, for each point, numbers as they are meant: pairs are still to be added.
function readRows(value, counts, contacts, what, plain = false) {
  const total = counts.reduce((sum, n) => sum + n, 0);
  demand(list(value, what).length === total, () => `${what}: ${value.length} rows for ${total} contact points`);
  let at = 0;
  return contacts.map((contact, c) =>
    Array.from({ length: counts[c] }, () => {
      const row = list(value[at++], `a row of ${what}`).map((x) => number(x, what));
      const width = plain ? 3 : contact.edges ? contact.edges.length : contact.mu === 0 ? 1 : 3;
      demand(row.length === width || (!plain && row.length === 2 * width), () => `${what}: row ${at} has ${row.length} numbers`, { contact: c });
      return row.length === width ? [row] : [row.slice(0, width), row.slice(width)];
    }));
}

function readMotions(value, blocks, what) { // for every free block, six numbers
  demand(value instanceof Map, `${what} is not an object`);
  const free = blocks.filter((block) => !block.fixed);
  demand(value.size === free.length, () => `${what} is not of every free block and no other`);
  return blocks.map((block) => {
    if (block.fixed) return null;
    demand(value.has(block.id), () => `${what} lacks block ${quoted(block.id)}`, { block: block.id });
    return numbers(value.get(block.id), 6, `${what} of block ${quoted(block.id)}`);
  });
}

function readNode(value, model, depth, count) {
  demand(depth <= MAX_DEPTH, "the tree is too deep");
  demand(++count.nodes <= MAX_NODES, "the tree has too many nodes");
  demand(value instanceof Map, "a node of the tree is not an object");
  const child = (node) => readNode(node, model, depth + 1, count);
  if (!value.has("point")) {
    record(value, [], ["mechanism", "forces"], "a leaf of the tree");
    demand(value.size > 0, "a leaf of the tree is empty");
    return {
      motion: value.has("mechanism") ? readMotions(value.get("mechanism"), model.blocks, "motion of a leaf") : null,
      rows: value.has("forces") ? readRows(value.get("forces"), model.contacts.map((c) => c.polygon.length), model.contacts, "forces of a leaf", true) : null,
    };
  }
  const point = whole(value.get("point"), model.contacts.reduce((sum, c) => sum + c.polygon.length, 0), "point of a node");
  if (value.has("engaged")) {
    record(value, ["point", "engaged", "unloaded"], [], "a node of the tree");
    return { point, engaged: child(value.get("engaged")), unloaded: child(value.get("unloaded")) };
  }
  if (value.has("speed")) {
    record(value, ["point", "speed", "slower", "faster"], [], "a node of the tree");
    return { point, speed: number(value.get("speed"), "speed of a node"), slower: child(value.get("slower")), faster: child(value.get("faster")) };
  }
  record(value, ["point", "rays", "sectors"], [], "a node of the tree");
  const rays = list(value.get("rays"), "rays of a node").map((ray) => numbers(ray, 3, "a ray"));
  return { point, rays, sectors: list(value.get("sectors"), "sectors of a node").map(child) };
}

function readForm(text, root) {
  demand(root.get("schema") === SCHEMA, () => `this is version ${quoted(String(root.get("schema")).slice(FAMILY.length))} of certificates; only 2 is checked. Check the model again`);
  const kind = root.get("kind");
  demand(typeof kind === "string" && Object.hasOwn(KEYS, kind), "the kind of proof is missing or unknown");
  const [must, may = []] = KEYS[kind];
  record(root, [...FREE_FORM, ...must], may, "the certificate");
  const model = { kind, gravity: numbers(root.get("gravity"), 3, "gravity"), tolerance: number(root.get("tolerance"), "tolerance") };
  demand(model.tolerance >= 0, "tolerance is negative");
  model.blocks = list(root.get("blocks"), "blocks").map(readBlock);
  demand(model.blocks.length > 0, "there is no block");
  const index = new Map(model.blocks.map((block, k) => [block.id, k]));
  demand(index.size === model.blocks.length, "two blocks have the same id");
  model.contacts = list(root.get("contacts"), "contacts").map((c, k) => readContact(c, k, index, model.blocks, kind));
  model.loads = readLoads(root.get("loads"), index);
  const some = model.blocks.some((block) => !block.fixed);
  if (kind === "limit-bounds") readBounds(model, root, index);
  for (const key of COUPLED) if (must.includes(key)) model[key] = positive(root.get(key), key);
  if (must.includes("eta")) demand(model.beta_min < model.eta, "beta_min is not less than eta");
  let counts = model.contacts.map((c) => c.polygon.length);
  if (must.includes("within")) readWithin(model, root, must.includes("points"));
  if (model.inner) counts = model.inner.map((points) => points.length);
  if (must.includes("forces") || model.lower !== undefined) model.rows = readRows(root.get("forces"), counts, model.contacts, "forces");
  if (root.has("recession")) model.recession = readRows(root.get("recession"), counts, model.contacts, "recession");
  for (const key of ["mechanism", "motions"]) if (root.has(key)) model.motion = readMotions(root.get(key), model.blocks, key);
  if (must.includes("settlements")) readSettlements(model, root, index);
  if (root.has("component")) {
    const id = root.get("component");
    demand(index.has(id) && !model.blocks[index.get(id)].fixed, "component is not the id of a free block");
    model.component = index.get(id);
    restrict(model);
  }
  if (must.includes("tree")) model.tree = readNode(root.get("tree"), model, 0, { nodes: 0 });
  demand(some || model.rows, "no block is free");
  demand(typeof root.get("seal") === "string" && sealed(text, root), "the seal does not fit: the file was damaged or changed after it was written");
  return model;
}

function readBounds(model, root, index) {
  const live = record(root.get("live"), ["gravity", "loads"], [], "live");
  model.live = { gravity: numbers(live.get("gravity"), 3, "live gravity"), loads: readLoads(live.get("loads"), index) };
  for (const [side, proof] of [["lower", "forces"], ["upper", "mechanism"]]) {
    demand(root.has(side) === root.has(proof), `${side} goes with ${proof}`);
    if (root.has(side)) model[side] = number(root.get(side), side);
  }
  demand(root.has("lower") || root.has("upper"), "there is neither a lower nor an upper bound");
  if (root.has("lower") && root.has("upper")) demand(model.lower <= model.upper, "lower is more than upper");
  if (root.has("recession")) demand(root.has("lower") && !root.has("upper"), "recession goes with lower, and without upper");
}

function readSettlements(model, root, index) {
  const given = root.get("settlements");
  demand(given instanceof Map && given.size > 0, "settlements are not those of at least one block");
  model.settlements = new Map();
  for (const [id, row] of given) {
    demand(index.has(id) && model.blocks[index.get(id)].fixed, () => `settlement of ${quoted(id)}, which is no fixed block`);
    model.settlements.set(index.get(id), numbers(row, 6, `settlement of ${quoted(id)}`));
  }
}

function readWithin(model, root, state) {
  const within = record(root.get("within"), ["length"], ["slope"], "within");
  model.within = { length: positive(within.get("length"), "length of within") };
  if (within.has("slope")) {
    model.within.slope = number(within.get("slope"), "slope of within");
    demand(model.within.slope >= 0, "slope of within is negative");
  }
  demand(!model.blocks.some((block) => block.partly), "partial supports are not known in this kind");
  if (!state) return;
  const points = list(root.get("points"), "points"), ways = root.get("ways");
  demand(points.length === model.contacts.length, "points are not those of every contact");
  model.inner = points.map((some, c) => list(some, `points of contact ${c}`).map((p) => numbers(p, 3, `a point of contact ${c}`)));
  demand(ways instanceof Map && ways.size === model.blocks.filter((b) => !b.fixed).length, "ways are not those of every free block");
  model.ways = model.blocks.map((block, k) => {
    if (block.fixed) return -1;
    demand(ways.has(block.id), () => `ways lack block ${quoted(block.id)}`);
    const c = whole(ways.get(block.id), points.length, `way of ${quoted(block.id)}`);
    demand(model.contacts[c].a === k || model.contacts[c].b === k, () => `the way of ${quoted(block.id)} is a contact of others`, { block: block.id });
    return c;
  });
  demand(new Set(model.ways.filter((c) => c >= 0)).size === ways.size, "a contact is the way of two blocks");
}

// The part of the model that hangs together with one block: a model of its own, in which points are counted.
function restrict(model) {
  const group = components(model), inside = (k) => !model.blocks[k].fixed && group[k] === group[model.component];
  const contacts = model.contacts.filter((c) => inside(c.a) || inside(c.b));
  model.all = { blocks: model.blocks, contacts: model.contacts };
  model.blocks = model.blocks.map((block, k) => (inside(k) || block.fixed ? block : Object.assign(Object.create(block), { fixed: true })));
  model.contacts = contacts;
}

function components(model) { // for each block the first of its component; a support is its own
  const group = model.blocks.map((_, k) => k);
  const find = (k) => {
    while (group[k] !== k) k = group[k] = group[group[k]];
    return k;
  };
  for (const { a, b } of model.contacts) {
    if (!model.blocks[a].fixed && !model.blocks[b].fixed) {
      const [i, j] = [find(a), find(b)];
      group[most(i, j)] = least(i, j);
    }
  }
  return group.map((_, k) => find(k));
}

// ---- Units: from doubles to whole numbers

const DOUBLE = new Float64Array(1), WORDS = new Uint32Array(DOUBLE.buffer); // little-endian, as every browser's machine
function parts(x) { // x = m 2^e, m odd or 0
  if (x === 0) return [0, 0];
  DOUBLE[0] = x;
  const [low, high] = WORDS;
  const e = ((high >>> 20) & 2047) - 1075; // sizes from 1e-150 on are normal numbers
  const top = (high & 0xfffff) | 0x100000;
  const zeros = low ? 31 - Math.clz32(low & -low) : 63 - Math.clz32(top & -top);
  const m = (top * 2 ** 32 + low) / 2 ** zeros;
  return [x < 0 ? -m : m, e + zeros];
}

function bitsOf(...values) { // behind the binary point that these need, at least 0
  let bits = 0;
  for (const value of values.flat(4)) {
    const [m, e] = parts(value);
    if (m && -e > bits) bits = -e;
  }
  return bits;
}

function toWhole(x, bits) {
  const [m, e] = parts(x);
  return BigInt(m) << BigInt(e + bits);
}
const wholeVector = (row, bits) => row.map((x) => toWhole(x, bits));

// The unit of length is 2^-lengths m, of forces 2^-forces / 24 N, of rotations 2^-turns.
function toUnits(model) {
  const { blocks, contacts, loads, live, gravity } = model;
  const all = model.all ?? model;
  const liveLoads = live ? live.loads : [], within = model.within;
  const lengths = Math.max(
    ...all.blocks.map((b) => bitsOf(b.vertices)), ...all.contacts.map((c) => bitsOf(c.polygon)),
    bitsOf([...loads, ...liveLoads].map((l) => l.point), model.tolerance, within ? within.length : 0, model.inner ?? []),
    ...all.contacts.map((c) => (c.normal ? Math.ceil(bitsOf(c.normal) / 2) : 0)));
  const densities = bitsOf(blocks.map((b) => b.density)), standard = 9.80665;
  const multiplier = bitsOf([model.lower ?? 0, model.upper ?? 0]);
  const accelerations = Math.max(bitsOf(gravity, standard), live ? bitsOf(live.gravity) + multiplier : 0);
  const rowBits = (contact, rows) => bitsOf(rows) + (contact.edges ? bitsOf(contact.edges) : contact.mu === 0 ? 2 * lengths : 0);
  const leafRows = model.tree ? leavesOf(model.tree).flatMap((leaf) => leaf.rows ?? []) : [];
  const forces = Math.max(
    densities + 3 * lengths + accelerations, bitsOf(loads.map((l) => l.force)), bitsOf(liveLoads.map((l) => l.force)) + multiplier,
    bitsOf(leafRows), ...contacts.map((c) => (c.tension ? bitsOf(c.tension) + 2 * lengths : 0)),
    ...[model.rows, model.recession].flatMap((rows) => (rows ? contacts.map((c, k) => rowBits(c, rows[k])) : [])));
  const motions = [model.motion ?? [], ...(model.tree ? leavesOf(model.tree).map((leaf) => leaf.motion ?? []) : []), model.settlements ? [...model.settlements.values()] : []];
  const turns = Math.max(0, ...motions.map((m) => Math.max(bitsOf(m.flatMap((row) => (row ? row.slice(3) : []))), bitsOf(m.flatMap((row) => (row ? row.slice(0, 3) : []))) - lengths)),
    bitsOf(COUPLED.map((key) => model[key] ?? 0), model.tree ? speedsOf(model.tree) : []) - lengths);
  model.unit = { lengths, forces, turns, densities, accelerations, multiplier };
  const force = (row) => wholeVector(row, forces).map((x) => 24n * x);
  model.unit.force = force;
  model.unit.motion = (row) => ({ v: wholeVector(row.slice(0, 3), lengths + turns), w: wholeVector(row.slice(3), turns) });
  model.unit.speed = (x) => toWhole(x, lengths + turns);
  model.tol = toWhole(model.tolerance, lengths);
  if (within) model.L = toWhole(within.length, lengths);
  for (const block of all.blocks) block.corners = block.vertices.map((v) => wholeVector(v, lengths));
  for (const contact of all.contacts) {
    contact.points = contact.polygon.map((p) => wholeVector(p, lengths));
    contact.N = contact.normal ? wholeVector(contact.normal, 2 * lengths) : areaVector(contact.points);
    contact.NN = square(contact.N);
    demand(contact.NN > 0n, `contact ${contact.k} has no area, or no normal`, { contact: contact.k });
    const [p, e] = parts(contact.mu);
    contact.p = e > 0 ? BigInt(p) << BigInt(e) : BigInt(p);
    contact.q = e < 0 ? 1n << BigInt(-e) : 1n;
    if (contact.edges) {
      const bits = bitsOf(contact.edges);
      contact.rays = contact.edges.map((edge) => wholeVector(edge, bits));
      contact.raysBits = bits;
      demand(contact.rays.every((ray) => dot(ray, contact.N) > 0n), `contact ${contact.k}: an edge of its pyramid does not lead from a into b`, { contact: contact.k });
    }
  }
}

function leavesOf(node) {
  const nodes = [node], found = [];
  while (nodes.length) {
    const at = nodes.pop();
    if (at.point === undefined) found.push(at);
    else nodes.push(...childrenOf(at));
  }
  return found;
}
const childrenOf = (node) => node.sectors ?? (node.engaged ? [node.engaged, node.unloaded] : [node.slower, node.faster]);
function speedsOf(node) {
  return node.point === undefined ? [] : [node.speed ?? 0, ...childrenOf(node).flatMap(speedsOf)];
}

// Forces of a contact's points as their rows have them; of pyramids also how much along each edge.
function forceOf(model, contact, row) {
  const { forces, lengths } = model.unit;
  if (contact.rays) {
    const shares = contact.rays.map((_, k) => row.reduce((sum, half) => sum + 24n * toWhole(half[k], forces - contact.raysBits), 0n));
    return { F: contact.rays.reduce((sum, ray, k) => add(sum, times(ray, shares[k])), ZERO), shares };
  }
  if (contact.mu === 0) return { F: times(contact.N, row.reduce((sum, half) => sum + 24n * toWhole(half[0], forces - 2 * lengths), 0n)) };
  return { F: row.map((half) => model.unit.force(half)).reduce(add) };
}

// ---- Geometry

function areaVector(points) { // Newell's, twice the area
  let sum = ZERO;
  for (let i = 1; i + 1 < points.length; i++) sum = add(sum, cross(sub(points[i], points[0]), sub(points[i + 1], points[0])));
  return sum;
}

function trianglesOf(face, corners) {
  return face.slice(2).map((k, i) => [corners[face[0]], corners[face[i + 1]], corners[k]]);
}

// Volume, centre and diagonal of each block: 6 V, M = 24 V c and D^2; and whether its mesh bounds a solid.
function measure(block) {
  const where = { block: block.id }, told = `block ${quoted(block.id)}`;
  const edges = new Map();
  block.faces.forEach((face, f) => face.forEach((i, k) => {
    const j = face[(k + 1) % face.length], key = i * block.corners.length + j;
    demand(!edges.has(key), `${told}: its mesh has an edge twice in one direction`, where);
    edges.set(key, f);
  }));
  for (const key of edges.keys()) {
    const i = Math.floor(key / block.corners.length), j = key % block.corners.length;
    demand(edges.has(j * block.corners.length + i), `${told}: its mesh is open`, where);
  }
  demand(block.faces.length > 0, `${told} has no face`, where);
  const used = [...new Set(block.faces.flat())].map((i) => block.corners[i]), origin = used[0];
  const near = block.corners.map((r) => sub(r, origin));
  const triangles = block.faces.flatMap((face) => trianglesOf(face, near));
  let volume = 0n, moment = ZERO;
  for (const [a, b, c] of triangles) {
    const part = dot(a, cross(b, c));
    volume += part;
    moment = add(moment, times(add(add(a, b), c), part));
  }
  demand(volume > 0n, `${told} has no volume, or is inside out`, where);
  block.V6 = volume;
  block.q = 4n * volume; // the centre is M / q
  block.M = add(moment, times(origin, block.q));
  block.box = boxOf(used);
  block.DD = square(sub(block.box[1], block.box[0]));
  block.pieces = 1;
  const shells = shellsOf(block, edges);
  block.convex = shells.length === 1 && isConvex(block);
  if (shells.length > 1 || !isStar(triangles, moment.map((x) => floorDiv(x, block.q)))) boundsSolid(block, shells, near, told, where);
}

function isConvex({ faces, corners }) { // so that it can be told how deep it runs into another
  return faces.length * corners.length <= MAX_CONVEX && faces.every((face) => {
    const N = areaVector(face.map((i) => corners[i])), heights = corners.map((r) => dot(r, N));
    const base = face.map((i) => heights[i]).reduce(least), depth = base - heights.reduce(least);
    return depth > 0n && (heights.reduce(most) - base) << 20n <= depth;
  });
}

// Whether every triangle is seen from the centre from inside, and exactly one of them in the direction of the first. Then
// the surface meets every ray from there once: one shell around one solid, and nothing lies on anything else.
function isStar(triangles, centre) {
  const seen = [];
  for (const triangle of triangles) {
    const [a, b, c] = triangle.map((r) => sub(r, centre));
    const ab = cross(a, b), depth = dot(ab, c);
    if (depth < 0n || (depth === 0n && !isZero(cross(sub(b, a), sub(c, a))))) return false;
    if (depth > 0n) seen.push([a, b, c, ab]);
  }
  const ray = seen[0].slice(0, 3).reduce(add);
  let hits = 0;
  for (const [a, b, c, ab] of seen) {
    const sides = [dot(ray, ab)];
    if (sides[0] < 0n) continue;
    sides.push(dot(ray, cross(b, c)), dot(ray, cross(c, a)));
    if (sides.some((x) => x < 0n)) continue;
    if (sides.some((x) => x === 0n)) return false;
    hits++;
  }
  return hits === 1;
}

function shellsOf(block, edges) { // faces that hang together by edges
  const shell = block.faces.map((_, f) => f), n = block.corners.length, shells = new Map();
  const find = (f) => (shell[f] === f ? f : (shell[f] = find(shell[f])));
  for (const [key, f] of edges) shell[find(f)] = find(edges.get((key % n) * n + Math.floor(key / n)));
  block.faces.forEach((_, f) => shells.set(find(f), [...(shells.get(find(f)) ?? []), f]));
  return [...shells.values()];
}

function boundsSolid(block, shells, corners, told, where) {
  const all = shells.map((faces) => {
    const triangles = faces.flatMap((f) => trianglesOf(block.faces[f], corners));
    const flat = triangles.flat();
    const [low, high] = boxOf(flat), sides = sub(high, low).reduce((x, y) => x + y);
    const areas = triangles.reduce((sum, t) => areaVector(t).reduce((s, x) => s + size(x), sum), 0n);
    const volume = triangles.reduce((sum, [a, b, c]) => sum + dot(sub(a, flat[0]), cross(sub(b, flat[0]), sub(c, flat[0]))), 0n);
    demand(size(volume) << 30n > sides * areas, `${told}: a shell of it has no volume`, where);
    return { triangles, outward: volume > 0n };
  });
  if (all.length > 1) {
    for (const one of all) {
      const depth = all.reduce((sum, other) => (other === one || !lies(one, other) ? sum : sum + (other.outward ? 1 : -1)), 0);
      demand(depth === (one.outward ? 0 : 1), `${told}: a shell of it lies where it should not`, where);
    }
    block.pieces = all.filter((one) => one.outward).length;
  }
  noFacesOnEachOther(block, corners, told, where);
}

// Whether a shell lies inside another, by its corners that are not on that. Of shells that cross, stone counts as in stone
// with one corner, and a hole, or stone in a hole, only with all.
function lies(one, other) {
  const sides = new Set(one.triangles.flat()), whole = one.outward !== other.outward;
  let some = false;
  for (const corner of sides) {
    const inside = contains(other, times(corner, 3n));
    if (inside === null) continue;
    if (inside !== whole) return inside;
    some = true;
  }
  if (some) return whole;
  return one.triangles.some((triangle) => contains(other, triangle.reduce(add)));
}

function contains(shell, from) { // three times a point; null where it is on the surface
  for (let k = 1n; k < 8n; k++) { // along a ray that meets no edge
    const ray = [1000003n * k + 17n, 998244353n - 7919n * k * k, 715827883n + 104729n * k];
    let odd = false, clear = true;
    for (const corners of shell.triangles) {
      const [a, b, c] = corners.map((r) => sub(times(r, 3n), from));
      const signs = [dot(ray, cross(a, b)), dot(ray, cross(b, c)), dot(ray, cross(c, a))];
      if (signs.some((x) => x > 0n) && signs.some((x) => x < 0n)) continue;
      const normal = areaVector([a, b, c]), along = dot(normal, ray), ahead = dot(normal, a);
      if (isZero(normal)) continue;
      if (along !== 0n && ahead === 0n) return null;
      if (signs.some((x) => x === 0n) || along === 0n) clear = false;
      if (ahead > 0n === along > 0n) odd = !odd;
    }
    if (clear) return odd;
  }
  return null;
}

function gcd(a, b) {
  while (b) [a, b] = [b, a % b];
  return size(a);
}

function noFacesOnEachOther(block, corners, told, where) {
  const planes = new Map(), same = new Set();
  for (const face of block.faces) {
    const key = face.map((i) => corners[i].join()).sort().join(" ");
    demand(!same.has(key), `${told}: two faces have the same corners`, where);
    same.add(key);
    const points = face.map((i) => corners[i]), N = areaVector(points);
    const flat = !isZero(N) && points.every((r) => dot(sub(r, points[0]), N) === 0n);
    for (const part of flat ? [points] : trianglesOf(face, corners)) {
      const normal = areaVector(part);
      if (isZero(normal)) continue;
      const first = normal.find((x) => x !== 0n), scale = gcd(gcd(normal[0], normal[1]), normal[2]) * (first < 0n ? -1n : 1n);
      const unit = normal.map((x) => x / scale), plane = `${unit.join()} ${dot(unit, part[0])}`;
      const k = unit[0] ? 0 : unit[1] ? 1 : 2; // an axis that the plane is not along
      const flatPart = part.map((r) => [r[(k + 1) % 3], r[(k + 2) % 3]]);
      if (unit[k] < 0n !== scale < 0n) flatPart.reverse(); // all counter-clockwise
      planes.set(plane, [...(planes.get(plane) ?? []), flatPart]);
    }
  }
  for (const faces of planes.values()) {
    faces.forEach((face, i) => {
      demand(!crossesItself(face), `${told}: a face crosses itself`, where);
      for (let j = 0; j < i; j++) demand(!overlap(face, faces[j]), `${told}: two of its faces lie on each other`, where);
    });
  }
}

const turn2 = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
const sign = (x) => (x > 0n ? 1 : x < 0n ? -1 : 0);
const edgesOf = (face) => face.map((a, i) => [a, face[(i + 1) % face.length]]);

function edgesCross(a, b, c, d) {
  return sign(turn2(a, b, c)) * sign(turn2(a, b, d)) < 0 && sign(turn2(c, d, a)) * sign(turn2(c, d, b)) < 0;
}

function crossesItself(face) {
  const edges = edgesOf(face);
  return edges.some(([a, b], i) => edges.some(([c, d], j) => j < i && (edgesCross(a, b, c, d) || alongEachOther(a, b, c, d))));
}

function alongEachOther(a, b, c, d) { // in the same direction, with a length in common
  if (turn2(a, b, c) !== 0n || turn2(a, b, d) !== 0n) return false;
  const t = (r) => (r[0] - a[0]) * (b[0] - a[0]) + (r[1] - a[1]) * (b[1] - a[1]);
  return t(d) > t(c) && t(c) < t(b) && t(d) > 0n;
}

// Two simple polygons, both counter-clockwise, have an area in common if edges cross, or run along each other the same way,
// or a piece of an edge of one, cut where the other touches it, has its middle inside the other.
function overlap(one, other) {
  const [A, B] = [edgesOf(one), edgesOf(other)];
  if (A.some(([a, b]) => B.some(([c, d]) => edgesCross(a, b, c, d) || alongEachOther(a, b, c, d)))) return true;
  return entersInside(A, B, other, one) || entersInside(B, A, one, other);
}

function entersInside(edges, cutters, polygon, own) {
  return edges.some(([a, b]) => {
    const along = [b[0] - a[0], b[1] - a[1]], length = along[0] ** 2n + along[1] ** 2n;
    const t = (r) => (r[0] - a[0]) * along[0] + (r[1] - a[1]) * along[1];
    const cuts = [0n, length, ...polygon.filter((r) => turn2(a, b, r) === 0n && t(r) > 0n && t(r) < length).map(t)].sort((x, y) => (x < y ? -1 : x > y ? 1 : 0));
    for (let k = 0; k + 1 < cuts.length; k++) {
      if (cuts[k] === cuts[k + 1]) continue;
      const scale = 2n * length, middle = a.map((x, i) => x * scale + along[i] * (cuts[k] + cuts[k + 1]));
      if (strictlyInside(middle, polygon.map((r) => [r[0] * scale, r[1] * scale]))) return true;
    }
    return false;
  });
}

function strictlyInside(p, polygon) {
  let odd = false;
  for (const [a, b] of edgesOf(polygon)) {
    const turn = turn2(a, b, p);
    if (turn === 0n && (a[0] - p[0]) * (b[0] - p[0]) + (a[1] - p[1]) * (b[1] - p[1]) <= 0n) return false;
    if (a[1] > p[1] !== b[1] > p[1] && turn > 0n === b[1] > a[1]) odd = !odd;
  }
  return odd;
}

// Facets of a block: whole faces where they are flat, else their triangles. What is needed to tell what lies near them.
function facetsOf(model, block) {
  if (block.facets) return block.facets;
  const tol4 = least(40000n * model.tol * model.tol, block.DD);
  block.facets = [];
  for (const face of block.faces) {
    const whole = facet(block, face);
    if (whole && face.every((i) => isWithin(whole, block.corners[i], tol4))) block.facets.push(whole);
    else for (let k = 2; k < face.length; k++) block.facets.push(facet(block, [face[0], face[k - 1], face[k]]));
  }
  block.facets = block.facets.filter((f) => f);
  return block.facets;
}

function facet(block, face) {
  const points = face.map((i) => block.corners[i]), N = areaVector(points), NN = square(N);
  if (NN === 0n) return null;
  const made = { face, points, N, NN, n: BigInt(points.length), sum: points.reduce(add), edges: null };
  const off = points.map((r) => size(rise(made, r))).reduce(most), wide = ceilRoot(ceilDiv(off * off, made.n * made.n * NN));
  const [low, high] = boxOf(points);
  made.box = [low.map((x) => x - wide), high.map((x) => x + wide)]; // of the corners, and of their places in the plane
  return made;
}
// tol4 is 40,000 tol^2: both shares, 0.5 % and 2.5 %, are whole two-hundredths.
const rise = ({ N, n, sum }, p) => dot(sub(times(p, n), sum), N); // above the plane through the mean, across N, times n |N|
const isWithin = (f, p, tol4) => 40000n * rise(f, p) ** 2n <= tol4 * f.n * f.n * f.NN;

function beside2(f, p, tol4) { // how far p is beside a facet, squared: a fraction; null where that is more than tol
  if (!isWithin(f, p, tol4)) return null;
  if (!f.edges) {
    const { u, v } = planeOf(f);
    f.axes = [u, v]; // in its plane: a facet that is not quite flat is seen along N
    f.flat = f.points.map((r) => f.axes.map((axis) => dot(r, axis)));
    f.edges = sidesOf(f.points);
  }
  if (strictlyInside(f.axes.map((axis) => dot(p, axis)), f.flat)) return [0n, 1n];
  const near = f.edges.map((e, i) => apart2(sub(p, f.points[i]), e)).filter(([n, d]) => 40000n * n <= tol4 * d);
  return near.length ? near.reduce((x, y) => (y[0] * x[1] < x[0] * y[1] ? y : x)) : null;
}

function apart2(x, e) { // of x from the segment from 0 to e, squared: a fraction
  const t = dot(x, e), ee = square(e);
  if (t <= 0n || ee === 0n) return [square(x), 1n];
  return t >= ee ? [square(sub(x, e)), 1n] : [square(cross(x, e)), ee];
}

const leansLittle = (N, NN, M, MM) => square(cross(N, M)) * 1000000n <= NN * MM; // sine at most 1e-3

const isRough = ({ surface }) => surface === "rough" || surface === "curved";

function toleranceAt(model, contact) { // squared, times 40000
  const { blocks } = model.all ?? model, small = least(blocks[contact.a].DD, blocks[contact.b].DD);
  return least(40000n * model.tol * model.tol, small * (isRough(contact) ? 25n : 1n));
}

function checkContact(model, contact) {
  const { k, points, N, NN, surface } = contact, where = { contact: k }, all = model.all ?? model;
  const sides = [all.blocks[contact.a], all.blocks[contact.b]];
  const rough = isRough(contact), small = least(sides[0].DD, sides[1].DD), tol4 = toleranceAt(model, contact);
  const told = jointName(all, contact);
  if (surface !== "point") {
    const plane = { N, NN, n: BigInt(points.length), sum: points.reduce(add) };
    demand(points.every((r) => isWithin(plane, r, tol4)), `${told} is not flat`, where);
    demand(rough || (200n * rootDown(NN)) << GUARD > 4n * rootUp(tol4) * perimeterUp(points), `${told} is no wider than four tolerances`, where);
  }
  const looking = sides.map((block, side) => facetsAlong(model, block, contact, side, tol4, rough));
  const seats = points.map((r) => looking.map((facets) => seatOf(facets, r, tol4)));
  if (contact.tension && !rough) {
    const ring = seenAlong(contact, points), on = (f) => inCommon(ring, seenAlong(contact, f.points));
    looking.forEach((facets, side) => demand(2n * facets.reduce((sum, f) => sum + on(f), 0n) >= twiceArea(ring) << GUARD,
      () => `${told}: less than half of it is on faces of ${quoted(sides[side].id)}, and all would pull`, where));
  }
  if (surface === "point") checkPoint(model, contact, sides, tol4, told, seats[0]);
  else seats.forEach((pair, i) => pair.forEach((seat, side) => demand(seat, () => `${told}: point ${i} is not on a face of ${quoted(sides[side].id)}`, where)));
  if (rough) contact.near = seats.map((pair) => pair.map(({ on }, side) => on.map((f) => (side ? times(f.N, -1n) : f.N))));
  noteFit(model, seats, looking.flat(), contact, Math.sqrt(ratio(small, 1n)));
}

// No area pulls twice: no polygon goes round more than a thousandth of itself twice, nor lie two of the same blocks on each other by more.
function checkPulls(model) {
  const pulling = model.contacts.filter((contact) => contact.tension), fits = (shared, area) => 1000n * shared <= area << GUARD;
  pulling.forEach((contact, i) => {
    const ring = seenAlong(contact, contact.points), area = twiceArea(ring), where = { contact: contact.k };
    demand(fits(inCommon(ring, ring) - (area << GUARD), area), () => `${jointName(model, contact)} goes round some of its area twice, and would pull there twice`, where);
    for (const other of pulling.slice(0, i)) {
      if (!isBeside(model, contact, other)) continue;
      const there = seenAlong(contact, other.points);
      demand(fits(inCommon(ring, there), least(area, twiceArea(there))), () => `${jointName(model, other)} and ${jointName(model, contact)} lie on each other, and would pull there twice`, where);
    }
  });
}

function isBeside(model, one, other) { // of the same blocks, looking the same way within 36 degrees, and near its plane
  if (!(one.a === other.a && one.b === other.b) && !(one.a === other.b && one.b === other.a)) return false;
  const along = dot(one.N, other.N) * (one.a === other.a ? 1n : -1n);
  if (along <= 0n || 25n * along * along < 16n * one.NN * other.NN) return false;
  const rise = other.points.map((r) => size(dot(sub(r, one.points[0]), one.N))).reduce(least);
  return 40000n * rise * rise <= 16n * most(toleranceAt(model, one), toleranceAt(model, other)) * one.NN;
}

function seenAlong({ N, NN }, points) { // along N, in two axes of the world
  const drop = [0, 1, 2].reduce((x, y) => (size(N[y]) > size(N[x]) ? y : x));
  return points.map((r) => sub(times(r, NN), times(N, dot(r, N))).filter((_, axis) => axis !== drop));
}

const twiceArea = (ring) => size(edgesOf(ring).reduce((sum, [a, b]) => sum + a[0] * b[1] - a[1] * b[0], 0n));

// Twice the area in common, to 2^-128, each part as often as one goes round it times the other: of what is below their sides.
function inCommon(one, two) {
  const base = [...one, ...two].map((r) => r[1]).reduce(least);
  const sides = (ring) => edgesOf(ring).filter(([a, b]) => a[0] !== b[0]).map(([a, b]) => (a[0] < b[0] ? [a, b, 1n] : [b, a, -1n]));
  let total = 0n;
  for (const [a, b, way] of sides(one)) {
    for (const [c, d, back] of sides(two)) {
      const left = most(a[0], c[0]), right = least(b[0], d[0]), wide = b[0] - a[0], long = d[0] - c[0];
      if (left >= right) continue;
      const ends = [left, right].map((x) => [((a[1] - base) * wide + (b[1] - a[1]) * (x - a[0])) * long, ((c[1] - base) * long + (d[1] - c[1]) * (x - c[0])) * wide]);
      const [first, last] = ends.map(([p, q]) => p - q), below = least(...ends[0]) + least(...ends[1]);
      const bend = first < 0n !== last < 0n && first && last ? over(-first * last, size(first) + size(last)) : 0n; // they cross
      total += way * back * ceilDiv((right - left) * ((below << GUARD) + bend), wide * long);
    }
  }
  return size(total);
}

function facetsAlong(model, block, { points, N, NN }, side, tol4, rough) { // near a contact, that look along its normal
  const [low, high] = boxOf(points);
  return facetsOf(model, block).filter((f) => {
    const along = side ? -dot(f.N, N) : dot(f.N, N);
    if (along <= 0n || !(rough ? along * along * 400n >= f.NN * NN * 361n : leansLittle(f.N, f.NN, N, NN))) return false;
    return [...sub(low, f.box[1]), ...sub(f.box[0], high)].every((x) => x <= 0n || 40000n * x * x <= tol4);
  });
}

function seatOf(facets, r, tol4) { // on which of these a point lies; how far beside and above the nearest, in units of length
  const found = facets.map((f) => [f, beside2(f, r, tol4)]).filter(([, beside]) => beside);
  if (!found.length) return null;
  const seats = found.map(([f, [n, d]]) => {
    const up = rise(f, r), height = up && Math.sqrt(ratio(up * up, f.n * f.n * f.NN));
    return { beside: n && Math.sqrt(ratio(n, d)), height: up < 0n ? -height : Number(height) };
  });
  const nearest = seats.reduce((x, y) => (y.beside < x.beside || (y.beside === x.beside && Math.abs(y.height) < Math.abs(x.height)) ? y : x));
  return { on: found.map(([f]) => f), beside: Number(nearest.beside), height: nearest.height };
}

function noteFit(model, seats, facets, { N, NN }, small) { // the most of what contacts were let pass
  const fit = model.fit ??= { off: 0, gap: 0, overlap: 0, share: 0, lean: 0 }, metre = 2 ** model.unit.lengths;
  for (const pair of seats) {
    const [above, below] = pair.map((seat) => (seat ? seat.height : 0)), beside = pair.map((seat) => (seat ? seat.beside : 0));
    const most = { off: Math.max(Math.abs(above), Math.abs(below), ...beside), gap: above + below, overlap: -above - below };
    for (const key of Object.keys(most)) {
      fit[key] = Math.max(fit[key], most[key] / metre);
      fit.share = Math.max(fit.share, most[key] / small);
    }
  }
  for (const f of facets) fit.lean = Math.max(fit.lean, Math.asin(Math.sqrt(ratio(square(cross(f.N, N)), f.NN * NN))));
}

function checkPoint(model, contact, sides, tol4, told, seats) {
  const { N, NN, points: [p] } = contact;
  const up = (side) => (side ? times(N, -1n) : N), there = (side, room) => facetsOf(model, sides[side]).filter((f) => beside2(f, p, room));
  const tips = sides.map((block, side) => touching(there(side, tol4), block, up(side), p, tol4));
  if ((seats[0] && tips[1]) || (seats[1] && tips[0])) {
    contact.ridged = seats.some((seat, side) => seat && there(side, 16n * tol4).some((f) => fallsFrom(f, sides[side], up(side), NN, p, 16n * tol4)));
    return;
  }
  if (tips[0] && tips[1] && tips[0].edge && tips[1].edge) {
    const [e, f] = [tips[0].edge, tips[1].edge], m = cross(e, f), mm = square(m);
    if (100n * mm >= square(e) * square(f) && leansLittle(m, mm, N, NN)) return;
  }
  throw new NotProved(`${told}: the blocks do not touch there so that this is the normal`, { contact: contact.k });
}

function fallsFrom(f, block, N, NN, p, tol4) { // a facet that does not look along N, and is nowhere before the plane
  if (dot(f.N, N) > 0n && leansLittle(f.N, f.NN, N, NN)) return false;
  const rise = f.face.map((i) => dot(sub(block.corners[i], p), N)).reduce(most);
  return rise <= 0n || 40000n * rise * rise <= tol4 * NN;
}

// Edges or corners of two blocks on each other have some direction between all the normals listed of them, a force friction about that:
// in the cones of mu' they add up to no more, mu'^2 = mu^2 (1 + cos) / (2 + mu^2 (1 - cos)) with the largest angle between any two.
function loosenRidges({ contacts }) {
  const groups = new Map(), pair = ({ a, b }) => `${Math.min(a, b)} ${Math.max(a, b)}`;
  for (const one of contacts) if (one.ridged) groups.set(pair(one), [...(groups.get(pair(one)) ?? []), one]);
  for (const group of groups.values()) {
    const cosine = group.flatMap((one, i) => group.slice(i + 1).map((two) => cosineBelow(one, two))).reduce(least, UNIT);
    for (const one of cosine < UNIT ? group : []) {
      const pp = one.p * one.p, qq = one.q * one.q;
      one.grip = [isqrt(floorDiv(pp * (UNIT + cosine) << (2n * GUARD), 2n * qq * UNIT + pp * (UNIT - cosine))), UNIT];
    }
  }
}

function cosineBelow(one, two) { // of the angle between the normals, from the same block
  const along = dot(one.N, two.N) * (one.a === two.a ? 1n : -1n), whole = one.NN * two.NN;
  if (along > 0n && along * along === whole) return UNIT;
  return most(floorDiv(along << (2n * GUARD), along > 0n ? rootUp(whole) : rootDown(whole)), -UNIT);
}

// With what a block touches at a point, looking along N out of it: {edge}, {} for a corner, or nothing.
function touching(facets, block, N, p, tol4) {
  const corners = [...new Set(facets.flatMap((f) => f.face))];
  if (!corners.length) return null;
  const away = (i) => square(sub(block.corners[i], p)), height = (i) => dot(block.corners[i], N);
  const top = corners.reduce((i, j) => (height(j) > height(i) || (height(j) === height(i) && away(j) < away(i)) ? j : i));
  const shared = [];
  facets.forEach((f, k) => f.face.forEach((i, at) => {
    const j = f.face[(at + 1) % f.face.length];
    const g = facets.find((g) => g !== f && g.face.some((x, y) => x === j && g.face[(y + 1) % g.face.length] === i));
    if (g && (i === top || j === top)) shared.push({ f, g, along: sub(block.corners[j], block.corners[i]), from: i });
  }));
  if (!shared.length) return null;
  const fall = ({ along }) => [dot(along, N) ** 2n, square(along)];
  const edge = shared.reduce((x, y) => (fall(y)[0] * fall(x)[1] < fall(x)[0] * fall(y)[1] ? y : x));
  const looks = [edge.f, edge.g].filter((f) => dot(f.N, N) > 0n).length;
  const convex = dot(cross(edge.f.N, edge.g.N), edge.along) > 0n;
  if (!(looks === 2 || (looks === 1 && convex))) return null;
  const [drop, length] = fall(edge);
  const [away2, per] = apart2(sub(p, block.corners[edge.from]), edge.along);
  if (40000n * away2 <= tol4 * per && drop * 1000000n <= length * square(N)) return { edge: edge.along };
  return 40000n * away(top) <= tol4 ? {} : null;
}

// How deep convex blocks run into each other by more than the tolerance: [depth in m, one, other]; and how many pairs were
// not looked at, null where none was. All along axes, in doubles: it is told, and proves nothing.
function overlapsOf(model) {
  const { blocks, contacts } = model.all ?? model, metre = 2 ** model.unit.lengths, [low, high] = boxOf(blocks.flatMap((block) => block.box));
  const room = model.tol + (sub(high, low).reduce(most) >> 40n), found = [];
  const pairs = boxPairs(blocks, room), between = new Map(pairs.map((pair) => [pair.join(), []]));
  if (pairs.length > MAX_PAIRS) return { found, unseen: null };
  for (const { a, b, rays, N } of contacts) between.get(`${Math.min(a, b)},${Math.max(a, b)}`)?.push(...(rays ?? [N]));
  const places = blocks.map(({ corners, faces }) => () => [...new Set(faces.flat())].map((i) => sub(corners[i], blocks[0].box[0]).map((x) => Number(x) / metre)));
  let left = MAX_PROJECTED, unseen = 0;
  for (const pair of pairs) {
    const [one, two] = pair.map((k) => blocks[k]), [p, q] = pair.map((k) => (blocks[k].places ??= places[k]()));
    let depth = Number([...sub(one.box[1], two.box[0]), ...sub(two.box[1], one.box[0])].reduce(least)) / metre;
    for (const axis of axesBetween(model, one, two, between.get(pair.join()))) {
      if (depth * metre <= Number(room) || left <= 0) break;
      left -= p.length + q.length;
      const [x, y] = [p, q].map((some) => some.map((r) => dot(axis, r)));
      depth = Math.min(depth, x.reduce(larger) - y.reduce(smaller), y.reduce(larger) - x.reduce(smaller));
    }
    if (depth * metre <= Number(room)) continue;
    if (left > 0 && isMeasured(model, one, two)) found.push([depth, ...pair]);
    else unseen++;
  }
  return { found, unseen };
}
const larger = (x, y) => (x > y ? x : y), smaller = (x, y) => (x < y ? x : y);

function boxPairs(blocks, room) { // i < j, not both fixed, whose boxes overlap by more than that along all axes; by j, then i
  const start = (k) => blocks[k].box[0][0], pairs = [];
  let open = [];
  for (const j of blocks.map((_, k) => k).sort((i, j) => sign(start(i) - start(j)))) {
    const [low, high] = blocks[j].box;
    open = open.filter((i) => blocks[i].box[1][0] - low[0] > room);
    for (const i of open) {
      const apart = [...sub(blocks[i].box[1], low), ...sub(high, blocks[i].box[0])].some((x) => x <= room);
      if (!apart && !(blocks[i].fixed && blocks[j].fixed)) pairs.push([Math.min(i, j), Math.max(i, j)]);
    }
    open.push(j);
    if (pairs.length > MAX_PAIRS) break;
  }
  return pairs.sort((x, y) => x[1] - y[1] || x[0] - y[0]);
}

const isMeasured = (model, one, two) => one.convex && two.convex
  && axesOf(model, one).edges.length * axesOf(model, two).edges.length * (one.places.length + two.places.length) <= MAX_PROJECTED / 10;

function* axesBetween(model, one, two, normals) { // of contacts and faces, then of an edge of each
  yield* normals.map(unitOf);
  yield* axesOf(model, one).normals;
  yield* axesOf(model, two).normals;
  if (!isMeasured(model, one, two)) return;
  for (const e of axesOf(model, one).edges) for (const f of axesOf(model, two).edges) {
    const axis = cross(e, f), length = Math.hypot(...axis);
    if (length > 1e-30) yield times(axis, 1 / length);
  }
}

function axesOf(model, block) { // directions of its normals and edges, each once but for rounding
  if (block.axes) return block.axes;
  const all = facetsOf(model, block), every = block.convex ? 1 : Math.floor(all.length / 64) + 1, facets = all.filter((_, k) => k % every === 0);
  const once = (vectors) => [...new Map(vectors.map(unitOf).reverse().map((u) => {
    const way = u.find((x) => x !== 0) > 0 ? 1e9 : -1e9;
    return [u.map((x) => Math.round(way * x)).join(), u];
  })).values()].reverse(); // the first of each, in their order
  const edges = facets.flatMap(({ points }) => sidesOf(points)).filter((e) => !isZero(e));
  return block.axes = { normals: once(facets.map((f) => f.N)), edges: once(edges) };
}

function unitOf(vector) {
  const most = vector.map(size).reduce(larger), short = vector.map((x) => ratio(x, most));
  return times(short, 1 / Math.hypot(...short));
}

// ---- Loads, cones, motions

// Weights and loads at a multiplier of the live ones; `scale` [0, 1] takes the live ones alone.
function loadingAt(model, multiplier = null, dead = true) {
  const { densities, lengths, accelerations, forces, multiplier: bits } = model.unit;
  const times1 = multiplier === null ? 0n : toWhole(multiplier, bits);
  let gravity = dead ? wholeVector(model.gravity, accelerations) : ZERO;
  if (model.live && times1) gravity = add(gravity, times(wholeVector(model.live.gravity, accelerations - bits), times1));
  const given = [];
  for (const load of dead ? model.loads : []) given.push({ ...load, F: model.unit.force(load.force) });
  for (const load of model.live && times1 ? model.live.loads : []) given.push({ ...load, F: times(wholeVector(load.force, forces - bits), 24n * times1) });
  const rest = BigInt(forces - densities - 3 * lengths - accelerations);
  return {
    pulls: model.blocks.map((block) => times(gravity, toWhole(block.density, densities) << rest)), // a 24th of weight by volume
    loads: given.filter((load) => !model.blocks[load.block].fixed).map((load) => ({ ...load, at: wholeVector(load.point, lengths) })),
  };
}
const weightOf = (loading, block, k) => times(loading.pulls[k], block.q);

function ownWeights(model) { // squares of w
  const { accelerations } = model.unit;
  const gravity = model.gravity.some((x) => x !== 0) ? model.gravity : [0, 0, 9.80665];
  const loading = loadingAt({ ...model, gravity, live: null });
  return model.blocks.map((block, k) => (block.fixed ? null : square(weightOf(loading, block, k))));
}

// Total of each component, rounded down for a state, where what supports take does not count, and up for a mechanism.
function totals(model, loading, group, state) {
  const sum = new Map(), root = state ? rootDown : rootUp;
  const count = (k, force, all) => {
    const { held } = model.blocks[k];
    sum.set(group[k], (sum.get(group[k]) ?? 0n) + root(square(state && all ? force.map((x, i) => (held[i] ? 0n : x)) : force)));
  };
  model.blocks.forEach((block, k) => { if (!block.fixed) count(k, weightOf(loading, block, k), true); });
  for (const { block, F } of loading.loads) count(block, F, model.blocks[block].held.slice(3).every((x) => x));
  return sum;
}

// Negative outside the cone, 0 on its edge, positive inside; `pull` is what the joint bears at the point, times |axis|.
function slack(F, axis, p, q, pull = 0n, unit = 1n) {
  const along = dot(F, axis), push = along * unit + pull;
  if (push < 0n) return -1;
  const across = (square(F) * square(axis) - along * along) * (unit * q) ** 2n;
  return sign(p * p * push * push - across);
}

function slackAt(contact, i, F, { pulls = true, scale = 1n } = {}) { // of F / scale, in all cones at the point
  const pull = pulls && contact.pull ? contact.pull[i] * scale : 0n;
  const [p, q] = contact.grip ?? [contact.p, contact.q];
  let worst = slack(F, contact.N, p, q, pull, contact.pull ? contact.pullUnit : 1n);
  for (const axes of contact.near ? contact.near[i] : []) {
    if (axes) worst = Math.min(worst, Math.max(...axes.map((axis) => slack(F, axis, contact.p, contact.q))));
  }
  return worst;
}

function spreadPull(model, contact) { // what an even stress comes to at each corner, times |N|
  const { points, N, NN, tension } = contact, n = points.length;
  let G = ZERO;
  for (let i = 1; i + 1 < n; i++) G = add(G, times(add(add(points[0], points[i]), points[i + 1]), dot(cross(sub(points[i], points[0]), sub(points[i + 1], points[0])), N)));
  const unit = 3n * NN; // the centroid is G / unit
  const shares = points.map((r, k) => {
    const next = points[(k + 1) % n];
    return unit * dot(cross(r, next), N) - dot(cross(G, sub(next, r)), N);
  });
  const stress = 24n * toWhole(tension, model.unit.forces - 2 * model.unit.lengths);
  contact.pull = points.map((_, k) => stress * (shares[(k + n - 1) % n] + shares[k]));
  contact.pullUnit = 4n * unit;
}

// Rigid motions about the world's origin: a point r moves by (U + W x r) / q.
function motionsOf(model, rows) {
  return model.blocks.map((block, k) => {
    const row = rows[k] ?? (model.settlements ? model.settlements.get(k) : null);
    if (!row) return { U: ZERO, W: ZERO, q: 1n, v: ZERO, w: ZERO };
    const { v, w } = model.unit.motion(row);
    demand(row.every((x, axis) => !block.held[axis] || x === 0), () => `block ${quoted(block.id)} moves where it is held`, { block: block.id });
    return { U: sub(times(v, block.q), cross(w, block.M)), W: times(w, block.q), q: block.q, v, w };
  });
}
const pathOf = (motion, r) => add(motion.U, cross(motion.W, r));

function relative(motions, contact, r) { // velocity of b against a is X / Q
  const [a, b] = [motions[contact.a], motions[contact.b]];
  return { X: sub(times(pathOf(b, r), a.q), times(pathOf(a, r), b.q)), Q: a.q * b.q };
}

function workOf(model, loading, motions, group) { // of weights and loads in each component, rounded down to 2^-128
  const work = new Map();
  const count = (k, x) => work.set(group[k], (work.get(group[k]) ?? 0n) + x);
  model.blocks.forEach((block, k) => { if (!block.fixed) count(k, dot(weightOf(loading, block, k), motions[k].v) << GUARD); });
  for (const { block, F, at } of loading.loads) count(block, floorDiv(dot(F, pathOf(motions[block], at)) << GUARD, motions[block].q));
  return work;
}

const groupOf = (model, group, { a, b }) => group[model.blocks[b].fixed ? a : b];

function loadsOn(model, loading) { // force, and moment about the world's origin
  const given = model.blocks.map((block, k) => ({ F: weightOf(loading, block, k), T: cross(block.M, loading.pulls[k]) }));
  for (const { block, F, at } of loading.loads) act(given[block], F, at);
  return given;
}

function act(wrench, F, r, way = 1n) {
  const pull = times(F, way);
  wrench.F = add(wrench.F, pull);
  wrench.T = add(wrench.T, cross(r, pull));
}

// Force and q times the moment about the centre, but what a partial support takes.
const unheld = ({ held, q, M }, { F, T }) => [F, sub(times(T, q), cross(M, F))].map((v, k) => v.map((x, i) => (held[3 * k + i] ? 0n : x)));

// Of what blocks have, the least in each component.
function leastOf(model, group, own) {
  const found = new Map();
  model.blocks.forEach((block, k) => { if (!block.fixed) found.set(group[k], least(found.get(group[k]) ?? own[k], own[k])); });
  return found;
}

// ---- States

// Forces inside their cones, no absurd ones, and balance. Answers whether every block balances exactly, by component.
function checkState(model, rows, loading, own, { corrected = true, pulls = true, progress = () => {}, what = "" } = {}) {
  const { blocks, contacts } = model, group = components(model);
  const left = loadsOn(model, loading).map((given, k) => (blocks[k].fixed ? null : { ...given, d: 1n }));
  const sizes = new Map();
  const forces = contacts.map((contact, c) => {
    if (c % 64 === 0) progress(c / contacts.length);
    const at = groupOf(model, group, contact);
    return contact.points.map((r, i) => {
      const { F, shares } = forceOf(model, contact, rows[c][i]);
      const fits = shares ? shares.every((x) => x >= 0n) : slackAt(contact, i, F, { pulls }) >= 0;
      demand(fits, () => `${what}${jointName(model, contact)}, point ${i}: the force is outside its cone`, { contact: c, point: i });
      const bears = shares ? shares.reduce((sum, x, k) => sum + x * x * square(contact.rays[k]), 0n) : square(F);
      sizes.set(at, (sizes.get(at) ?? 0n) + bears);
      if (left[contact.b]) act(left[contact.b], F, r);
      if (left[contact.a]) act(left[contact.a], F, r, -1n);
      return F;
    });
  });
  const total = totals(model, loading, group, true);
  for (const [at, sum] of sizes) {
    demand(sum << (2n * GUARD) <= (BOUND * total.get(at)) ** 2n, () => `${what}forces around block ${quoted(blocks[at].id)} are a million times its weight and loads`, { block: blocks[at].id });
  }
  const slight = leastOf(model, group, own);
  blocks.forEach((block, k) => { if (left[k]) left[k].rest = unheld(block, left[k]); }); // before anything is handed on
  const balanced = (k, scale) => {
    const { q, DD } = blocks[k], [rF, rM] = left[k].rest.map(square);
    return rF * BALANCE ** 2n <= scale && rM * BALANCE ** 2n <= scale * DD * q * q;
  };
  const unbalanced = (k) => () => `${what}block ${quoted(blocks[k].id)} is out of balance`;
  blocks.forEach((block, k) => { if (left[k]) demand(balanced(k, own[k]), unbalanced(k), { block: block.id }); });
  const failed = correct(model, forces, left, group, sizes, total, { corrected, pulls });
  blocks.forEach((block, k) => {
    if (left[k] && failed.has(group[k])) demand(balanced(k, slight.get(group[k])), unbalanced(k), { block: block.id });
  });
  return { forces, exact: failed.size === 0, group };
}

// Components in which what is left on the blocks cannot be sent down to the supports.
function correct(model, forces, left, group, sizes, total, { corrected, pulls }) {
  const { blocks, contacts } = model, failed = new Set(), rest = new Set();
  blocks.forEach((block, k) => { if (left[k] && !left[k].rest.every(isZero)) rest.add(group[k]); });
  if (!corrected || !rest.size) return corrected ? failed : rest;
  for (const [at, sum] of sizes) if (100n * (sum << (2n * GUARD)) > (BOUND * total.get(at)) ** 2n) failed.add(at);
  for (const contact of contacts) if (contact.mu > STEEP) failed.add(groupOf(model, group, contact));
  const ways = contacts.map((contact, c) => wayOf(contact, forces[c], c, pulls)).filter((way) => way);
  ways.sort((x, y) => (x.strength > y.strength ? -1 : x.strength < y.strength ? 1 : x.c - y.c));
  const at = blocks.map(() => []);
  ways.forEach((way, rank) => { for (const k of [contacts[way.c].a, contacts[way.c].b]) at[k].push(rank); });
  const reached = blocks.map((block) => block.fixed), order = [], frontier = new Set();
  blocks.forEach((block, k) => { if (block.fixed) at[k].forEach((rank) => frontier.add(rank)); });
  while (frontier.size) {
    const rank = [...frontier].reduce(smaller), { a, b } = contacts[ways[rank].c], block = !reached[a] ? a : !reached[b] ? b : -1;
    frontier.delete(rank);
    if (block < 0) continue;
    reached[block] = true;
    order.push({ ...ways[rank], block });
    at[block].forEach((next) => frontier.add(next));
  }
  blocks.forEach((block, k) => { if (left[k] && !reached[k] && !left[k].rest.every(isZero)) failed.add(group[k]); });
  for (const way of order.reverse()) if (!failed.has(group[way.block]) && !handOn(model, forces, left, way, pulls)) failed.add(group[way.block]);
  for (const at of [...failed]) if (!rest.has(at)) failed.delete(at);
  return failed;
}

function wayOf(contact, forces, c, pulls) {
  if (contact.rays) return null;
  const { points } = contact, inner = points.map((_, i) => i).filter((i) => slackAt(contact, i, forces[i], { pulls }) > 0);
  if (inner.length < 3) return null;
  const farthest = (of) => inner.reduce((i, j) => (of(j) > of(i) ? j : i));
  const first = inner[0], far = farthest((i) => square(sub(points[i], points[first])));
  const area = (i) => square(cross(sub(points[far], points[first]), sub(points[i], points[first])));
  const third = farthest(area);
  if (area(third) === 0n) return null;
  const strengths = inner.map((i) => square(forces[i])).sort((x, y) => (x < y ? 1 : x > y ? -1 : 0));
  return { c, strength: strengths[2], three: [first, far, third] };
}

// Take the wrench off a block through its way down; false if a force there leaves its cone.
function handOn(model, forces, left, { block, c, three }, pulls) {
  const contact = model.contacts[c], other = contact.a === block ? contact.b : contact.a, way = contact.b === block ? -1n : 1n;
  let { F, T, d } = left[block];
  const { q, M, partly } = model.blocks[block];
  if (partly) { // what its support takes stays there
    let about;
    [F, about] = unheld(model.blocks[block], left[block]);
    [T, F, d] = [add(about, cross(M, F)), times(F, q), d * q];
  }
  if (left[other]) {
    const { F: G, T: S, d: e } = left[other];
    left[other] = d === e ? { ...left[other], F: add(F, G), T: add(T, S) } : { ...left[other], F: add(times(F, e), times(G, d)), T: add(times(T, e), times(S, d)), d: d * e };
  }
  if (isZero(F) && isZero(T)) return true;
  const r = three.map((i) => contact.points[i]), sum = r.reduce(add);
  const w = times(F, way), t3 = sub(times(T, 3n * way), cross(sum, w));
  const e2 = sub(r[1], r[0]), e3 = sub(r[2], r[0]), m = cross(e2, e3), mm = square(m);
  const rho3 = r.map((x) => sub(times(x, 3n), sum)), s9 = rho3.reduce((x, y) => x + square(y), 0n);
  const c2 = -dot(t3, e3), c3 = dot(t3, e2), scale = 3n * d * mm * s9, turn = 3n * dot(t3, m);
  return three.every((i, k) => {
    const change = add(add(times(w, mm * s9), times(cross(m, rho3[k]), turn)), times(m, s9 * [-c2 - c3, c2, c3][k]));
    return slackAt(contact, i, add(times(forces[c][i], scale), change), { pulls, scale }) >= 0;
  });
}

// ---- Mechanisms

// |P(x)|^2 for the x = X / Q that contact and motion have, rounded up to 2^-256.
function resistance(contact, X, Q) {
  const up = (n, den) => ceilDiv(n << (2n * GUARD), den * Q * Q);
  if (contact.rays) return contact.rays.reduce((sum, ray) => sum + (dot(X, ray) > 0n ? up(dot(X, ray) ** 2n, square(ray)) : 0n), 0n);
  const { N, NN, p, q } = contact, d = dot(X, N), C2 = square(X) * NN - d * d;
  if (d <= 0n && p * p * C2 <= q * q * d * d) return 0n;
  if (d >= 0n && q * q * C2 <= p * p * d * d) return up(square(X), 1n);
  const along = (q * d << GUARD) + p * rootUp(C2);
  return ceilDiv(along * along, (p * p + q * q) * NN * Q * Q);
}

// Components that fall: for each how much the motion meets, ||P(-dd)||, in 2^-128.
function checkMechanism(model, rows, loading, own, progress = () => {}) {
  const { blocks, contacts } = model, group = components(model), motions = motionsOf(model, rows);
  const work = workOf(model, loading, motions, group), total = totals(model, loading, group, false), met = new Map();
  contacts.forEach((contact, c) => {
    if (c % 64 === 0) progress(c / contacts.length);
    const at = groupOf(model, group, contact);
    contact.points.forEach((r, i) => {
      const { X, Q } = relative(motions, contact, r);
      if (contact.pull) {
        const unit = contact.pullUnit, pull = contact.pull[i];
        work.set(at, work.get(at) - ceilDiv(pull * dot(X, contact.N) << GUARD, unit * contact.NN * Q));
        total.set(at, total.get(at) + ceilDiv(size(pull) << (2n * GUARD), unit * rootDown(contact.NN)));
      }
      if (!isZero(X)) met.set(at, (met.get(at) ?? 0n) + resistance(contact, times(X, -1n), Q));
    });
  });
  const moved = new Map(), slight = leastOf(model, group, own);
  blocks.forEach((block, k) => {
    if (block.fixed) return;
    const { v, w } = motions[k], at = group[k];
    moved.set(at, (moved.get(at) ?? 0n) + rootUp(square(v)) + rootUp(block.DD * square(w)));
  });
  const falls = new Map();
  for (const [at, gain] of work) {
    const norm = isqrt((met.get(at) ?? 0n)) + (met.get(at) ? 1n : 0n);
    const bound = (BOUND * total.get(at) * norm * BALANCE + rootUp(slight.get(at)) * moved.get(at)); // in 2^-256, times 1e9
    if (gain << GUARD > 0n && (gain << GUARD) * BALANCE > bound) falls.set(at, norm);
  }
  demand(falls.size, "the loads do not drive this motion by more than the contacts could resist");
  return { falls, motions, group };
}

// ---- Displacements that go with forces

function checkCoupling(model, forces, motions, own) {
  const { blocks, contacts, unit } = model, [eps, eta, beta] = COUPLED.map((key) => unit.speed(model[key])), t = COUPLING;
  contacts.forEach((contact, c) => contact.points.forEach((r, i) => {
    const { X, Q } = relative(motions, contact, r), F = forces[c][i], { N, NN } = contact;
    const fail = (rule) => { throw new NotProved(`${jointName(model, contact)}, point ${i}: ${rule}`, { contact: c, point: i }); };
    const d = dot(X, N), C2 = square(X) * NN - d * d, unit2 = NN * Q * Q; // dn^2 = d^2 / unit2, |dd_t|^2 = C2 / unit2
    const within = (x2, bound) => x2 * t * t <= (bound * (t + 1n)) ** 2n * unit2;
    if (d < 0n ? !within(d * d, eps) : !within(d * d, eta)) fail(d < 0n ? "overlaps by more than eps" : "opens by more than eta");
    if (!within(C2, eta)) fail("slides by more than eta");
    if (isZero(F)) return;
    const w2 = [contact.a, contact.b].filter((k) => !blocks[k].fixed).map((k) => own[k]).reduce(least), FF = square(F), s2 = most(FF, w2);
    const along = dot(F, N), low = rootDown(NN), high = rootUp(NN), s = rootDown(s2);
    const gap = [low, high].map((root) => size((d << GUARD) + eps * Q * root)).reduce(most); // |dn + eps| |N| Q
    if (along * gap * t > s * eps * Q * NN) fail("presses without overlapping by eps");
    const across2 = FF * NN - along * along; // |F_t|^2 |N|^2
    if (across2 === 0n) return;
    const turn = dot(cross(F, X), N) ** 2n * t * t;
    if (turn > s2 * eps * eps * unit2 || turn > s2 * SHORT * SHORT * C2) fail("friction is not along the sliding");
    const power = dot(F, X) * NN - along * d; // F_t.dd_t |N|^2 Q
    if (power > 0n && (power * t) ** 2n > s2 * (eps * Q * NN) ** 2n) fail("friction drives the sliding");
    if (across2 * t * t <= s2 * NN) return;
    if (C2 * t * t < (beta * (t - 1n)) ** 2n * unit2) fail("friction acts where it slides by less than beta_min");
    if (power >= 0n) fail("friction does not oppose the sliding");
  }));
}

function checkSettling(model, forces, motions, own, group) {
  const { blocks, contacts } = model, t = SETTLING, given = new Map(); // of each component: U, in 2^-128
  let met = false;
  for (const contact of contacts) for (const k of [contact.a, contact.b]) {
    if (!blocks[k].fixed) continue;
    met ||= model.settlements.has(k);
    const at = groupOf(model, group, contact), { q } = motions[k];
    for (const r of contact.points) given.set(at, most(given.get(at) ?? 0n, rootDown(square(pathOf(motions[k], r))) / q));
  }
  demand(met, "no contact point is on a block that the ground moves");
  contacts.forEach((contact, c) => contact.points.forEach((r, i) => {
    const { X, Q } = relative(motions, contact, r), F = forces[c][i], { N, NN, p, q } = contact, FF = square(F);
    const fail = (rule) => { throw new NotProved(`${jointName(model, contact)}, point ${i}: ${rule}`, { contact: c, point: i }); };
    const U = given.get(groupOf(model, group, contact)) ?? 0n, d = dot(X, N), C2 = square(X) * NN - d * d;
    const opens = ((t * d) << (2n * GUARD)) + U * rootDown(NN) * Q; // (dn + t U) |N| Q, times 1e7
    if (opens < 0n || (opens * q) ** 2n < (p * t) ** 2n * C2 << (4n * GUARD)) fail("it closes, or slides without opening");
    const s2 = most(FF, [contact.a, contact.b].filter((k) => !blocks[k].fixed).map((k) => own[k]).reduce(least));
    const small = (n2, den2) => n2 * t * t << (2n * GUARD) <= U * U * s2 * den2;
    if (!small(dot(F, X) ** 2n, Q * Q)) fail("the force works");
    if (d > 0n && !small(FF * d * d, NN * Q * Q)) fail("it bears a force, and has opened");
  }));
}

// ---- Trees: no coupled state. All here is in 2^-128 of its unit

const timesUp = (a, b) => ceilDiv(a * b, 1n << GUARD);
const over = (n, den) => ceilDiv(n << GUARD, den); // whole numbers to 2^-128, upward

// What no coupled state exceeds: displacement and rotation of each block, and the sum of all pushes.
function reachOf(model, loading) {
  const { blocks, contacts, unit } = model, [eps, eta] = [unit.speed(model.eps), unit.speed(model.eta)];
  const R = rootUp(2n * most(eps, eta) ** 2n);
  const links = contacts.flatMap((contact) => {
    const { points } = contact, from = (i) => sub(points[i], points[0]);
    const all = points.map((_, i) => i), farthest = (of) => all.reduce((i, j) => (of(j) > of(i) ? j : i));
    const e1 = from(farthest((i) => square(from(i)))), e2 = from(farthest((i) => square(cross(e1, from(i)))));
    const area = square(cross(e1, e2));
    if (area === 0n) return [];
    const T = over(2n * R, rootDown(square(e1))) + over(2n * R * (rootUp(square(e1)) + rootUp(square(e2))), rootDown(area) << GUARD);
    return [{ contact, T, r0: points[0] }];
  });
  const shortest = (step) => { // Dijkstra's
    const far = blocks.map((block) => (block.fixed ? 0n : null)), done = new Set();
    for (;;) {
      const at = far.reduce((i, x, k) => (x !== null && !done.has(k) && (i < 0 || x < far[i]) ? k : i), -1);
      if (at < 0) return far;
      done.add(at);
      for (const link of links) for (const [a, b] of [[link.contact.a, link.contact.b], [link.contact.b, link.contact.a]]) {
        if (a !== at || done.has(b)) continue;
        const x = far[a] + step(link, a, b);
        if (far[b] === null || x < far[b]) far[b] = x;
      }
    }
  };
  const omega = shortest((link) => link.T);
  blocks.forEach((block, k) => demand(omega[k] !== null, () => `block ${quoted(block.id)} hangs on no support: nothing bounds its displacement`, { block: block.id }));
  const arm = (k, r) => (blocks[k].fixed ? 0n : timesUp(omega[k], over(rootUp(square(sub(times(r, blocks[k].q), blocks[k].M))), blocks[k].q << GUARD)));
  const V = shortest(({ r0 }, a, b) => arm(a, r0) + R + arm(b, r0));
  const given = loadsOn(model, loading);
  const pushes = blocks.reduce((sum, block, k) => sum + (block.fixed ? 0n : wrenchSize(block, given[k], V[k], omega[k])), 0n);
  return { V, omega, B: ceilDiv(pushes, eps) };
}

function wrenchSize(block, given, V, omega) { // |r_F| V + |r_M| Omega
  const [rF, rM] = unheld(block, given).map((x) => rootUp(square(x)));
  return timesUp(rF, V) + timesUp(ceilDiv(rM, block.q), omega);
}

function checkTree(model, progress) {
  const { contacts, blocks, unit } = model, loading = loadingAt(model);
  const tree = { model, loading, given: loadsOn(model, loading), ...reachOf(model, loading), leaves: 0 };
  [tree.eps, tree.eta, tree.beta] = COUPLED.map((key) => unit.speed(model[key]));
  const owner = contacts.flatMap((contact) => contact.points.map((_, i) => ({ contact, i })));
  const alike = contacts.flatMap((contact) => likeMoving(blocks, contact));
  for (const contact of contacts) Object.assign(contact, { low: rootDown(contact.NN), high: rootUp(contact.NN) });
  const whole = { state: null, sector: null, slow: 0n, fast: tree.eta }, groups = new Map();
  const cell = owner.map((point, k) => { // what is said of a point: one object for all that move as it does
    const key = alike[k];
    if (!groups.has(key)) groups.set(key, { ...whole });
    return { ...point, said: groups.get(key) };
  });
  demand(blocks.some((block) => !block.fixed), "no block is free");
  const total = leavesOf(model.tree).length;
  const visit = (node) => {
    if (node.point === undefined) {
      if (tree.leaves % 16 === 0) progress(tree.leaves / total);
      tree.leaves++;
      return refute(tree, node, cell);
    }
    const { contact, said: at } = cell[node.point], before = { ...at }, told = `the tree splits point ${node.point}`;
    const each = (change, child) => { Object.assign(at, change); visit(child); Object.assign(at, before); };
    if (node.engaged) {
      demand(!at.state, `${told} twice into engaged and unloaded`);
      each({ state: "engaged" }, node.engaged);
      return each({ state: "unloaded" }, node.unloaded);
    }
    if (node.slower) {
      const speed = unit.speed(node.speed);
      demand(speed > at.slow && speed < at.fast, `${told} at a speed outside its interval`);
      each({ fast: speed }, node.slower);
      return each({ slow: speed }, node.faster);
    }
    sectorsOf(node, contact, at, told).forEach((sector, k) => each({ sector }, node.sectors[k]));
  };
  visit(model.tree);
  return tree.leaves;
}

// For each point of a contact a token that those share whose relative displacement is the same in every motion: two
// points' differ by the relative rotation times their difference.
function likeMoving(blocks, contact) {
  const ends = [blocks[contact.a], blocks[contact.b]].filter((block) => !block.fixed);
  const turning = [0, 1, 2].filter((axis) => ends.some((block) => !block.held[3 + axis]));
  const tokens = new Map();
  return contact.points.map((r, i) => {
    const apart = turning.length > 1 ? [i] : turning.length ? r.filter((_, axis) => axis !== turning[0]) : [];
    const key = apart.join();
    if (!tokens.has(key)) tokens.set(key, {});
    return tokens.get(key);
  });
}

function sectorsOf(node, { N }, at, told) {
  const bits = bitsOf(node.rays), rays = node.rays.map((ray) => wholeVector(ray, bits));
  const ahead = (x, y) => dot(N, cross(x, y)) > 0n, behind = (x, y) => dot(N, cross(x, y)) >= 0n;
  const chain = at.sector ? [at.sector[0], ...rays, at.sector[1]] : [...rays, rays[0]];
  demand(rays.length > 0 && node.sectors.length === chain.length - 1, `${told} into sectors that are not as many as its rays ask for`);
  const sectors = node.sectors.map((_, k) => [chain[k], chain[k + 1]]);
  demand(sectors.every(([x, y]) => ahead(x, y)), `${told} by rays that do not go round`);
  if (at.sector) demand(rays.every((ray) => ahead(at.sector[0], ray) && ahead(ray, at.sector[1])), `${told} by rays outside its sector`);
  else demand(sectors.slice(1, -1).every(([x, y]) => !(behind(x, rays[0]) && behind(rays[0], y))), `${told} by rays that go round more than once`);
  return sectors;
}

// The largest e.x / Q, over unit vectors e in the plane of the contact and in the sector.
function support({ contact: { N, NN, low }, said: { sector } }, X, Q) {
  const d = dot(X, N), C2 = square(X) * NN - d * d;
  if (C2 === 0n) return 0n;
  const inside = !sector || (dot(N, cross(sector[0], X)) >= 0n && dot(N, cross(X, sector[1])) >= 0n);
  if (inside) return ceilDiv(rootUp(C2) << GUARD, low * Q);
  return sector.map((e) => {
    const along = dot(e, N), n = dot(e, X) * NN - along * d, size2 = NN * (square(e) * NN - along * along);
    return ceilDiv(n << (2n * GUARD), (n < 0n ? rootUp(size2) : rootDown(size2)) * Q);
  }).reduce(most);
}

function refute(tree, leaf, cell) {
  const { model, loading, eps, eta, beta } = tree, both = leaf.motion && leaf.rows ? 1n : 0n;
  let left = 0n, right = 0n;
  if (leaf.motion) {
    const motions = motionsOf(model, leaf.motion);
    const work = [...workOf(model, loading, motions, components(model)).values()].reduce((x, y) => x + y, 0n);
    let worst = 0n;
    for (const at of cell) {
      if (at.said.state === "unloaded") continue;
      const { contact, i } = at, { X, Q } = relative(motions, contact, contact.points[i]), d = dot(X, contact.N);
      const dn = floorDiv(d << (2n * GUARD), (d < 0n ? contact.low : contact.high) * Q);
      const g = (both * eps << GUARD) + dn, excess = support(at, X, Q) - (both * most(beta, at.said.slow) << GUARD);
      worst = most(worst, -g);
      if (at.said.fast >= beta) worst = most(worst, -g + ceilDiv(contact.p * excess, contact.q)); // slower: no friction
    }
    left = work - timesUp(worst, tree.B);
  }
  if (leaf.rows) {
    const rest = tree.given.map(({ F, T }) => ({ F: times(F, both), T: times(T, both) }));
    let k = 0;
    model.contacts.forEach((contact, c) => contact.points.forEach((r, i) => {
      const F = model.unit.force(leaf.rows[c][i][0]), at = cell[k++], along = dot(F, contact.N);
      act(rest[contact.b], F, r, -1n);
      act(rest[contact.a], F, r);
      const dn = along < 0n || at.said.state === "engaged" ? -eps : eta, rub = support(at, F, 1n);
      const den = along * dn < 0n ? contact.high : contact.low;
      right += ceilDiv(along * dn << (2n * GUARD), den) + rub * (rub > 0n ? at.said.fast : at.said.slow);
    }));
    model.blocks.forEach((block, k) => {
      if (!block.fixed) right += wrenchSize(block, rest[k], tree.V[k], tree.omega[k]);
    });
  }
  demand(left > right, `leaf ${tree.leaves} of the tree does not show that its cell is empty`);
}

// ---- Every drawing of a family. Bounds in 2^-128 of their unit, rounded so that they hurt the claim

// How much volume and its first moment about the centre may change: V', and Q' along each axis.
function changes(block, L) {
  let V6 = 0n;
  const Q = [0n, 0n, 0n];
  for (const [a, b, c] of block.faces.flatMap((face) => trianglesOf(face, block.corners))) {
    const u = sub(b, a), v = sub(c, a); // the sides that meet in the first corner
    const B6 = 3n * rootUp(square(cross(u, v))) + 3n * L * (rootUp(square(u)) + rootUp(square(v))) + (4n * L * L << GUARD);
    V6 += L * B6;
    const away = [a, b, c].map((r) => sub(times(r, block.q), block.M));
    for (let k = 0; k < 3; k++) {
      const [x, y, z] = away.map((r) => r[k]), mean = ceilDiv(x * x + y * y + z * z + (x + y + z) ** 2n, 12n);
      Q[k] += timesUp(L * B6, ceilDiv(rootUp(mean), block.q) + (L << GUARD));
    }
  }
  return { V: ceilDiv(V6, 6n), Q: Q.map((x) => ceilDiv(x, 6n)) };
}

// tan(atan mu -+ theta), rounded down in a state and up in a mechanism; negative where there is none.
function leaning(model, contact, way) {
  const one = 1n << GUARD, mu = floorDiv(contact.p << GUARD, contact.q) + (way > 0 ? 1n : 0n);
  let tan;
  if (model.within.slope !== undefined) {
    const [m, e] = parts(model.within.slope);
    tan = e < 0 ? over(BigInt(m), 1n << BigInt(-e)) : BigInt(m) << BigInt(e) << GUARD;
  } else {
    const { points, NN } = contact, sine = over(2n * model.L * perimeterUp(points), rootDown(NN)); // twice the length, as |N| is twice the area
    if (sine >= one) return -1n;
    tan = over(sine, isqrt(one * one - sine * sine));
  }
  if (way < 0) return floorDiv((mu - tan) << GUARD, one + timesUp(mu + 1n, tan));
  const rest = one - timesUp(mu, tan);
  return rest > 0n ? over(mu + tan, rest) : -1n;
}

const planeOf = ({ points, N }) => { // two axes along it, and the height of a point times |N| n
  const n = BigInt(points.length), sum = points.reduce(add), e = points.map((r) => cross(N, sub(r, points[0]))).find((x) => !isZero(x));
  return { u: e, v: cross(N, e), height: (r) => size(dot(sub(times(r, n), sum), N)), n };
};

function checkStateWithin(model, own) {
  const { blocks, contacts, L } = model, group = components(model), loading = loadingAt(model), given = loadsOn(model, loading);
  const sizes = new Map(), rub = blocks.map(() => 0n);
  contacts.forEach((contact, c) => {
    const told = jointName(model, contact), where = { contact: c };
    const at = groupOf(model, group, contact), plane = planeOf(contact);
    contact.low = rootDown(contact.NN);
    contact.high = rootUp(contact.NN);
    contact.inner = model.inner[c].map((p) => wholeVector(p, model.unit.lengths));
    demand(contact.inner.every((p) => isInner(contact, plane, p, L)), `${told}: a point is nearer to its outline than the length`, where);
    contact.h = (L << GUARD) + over(contact.inner.map(plane.height).reduce(most, 0n) << GUARD, plane.n * contact.low);
    contact.mu1 = leaning(model, contact, -1);
    contact.F = model.rows[c].map((row) => forceOf(model, contact, row).F);
    demand(contact.mu <= STEEP || !contact.F.length, `${told}: mu is above ${STEEP}`, where);
    contact.F.forEach((F, i) => {
      const along = dot(F, contact.N), across2 = square(F) * contact.NN - along * along;
      demand(isZero(F) || (along > 0n && contact.mu1 >= 0n && across2 << (2n * GUARD) <= (contact.mu1 * along) ** 2n), `${told}, point ${i}: the force is outside a cone of the family`, where);
      sizes.set(at, (sizes.get(at) ?? 0n) + square(F));
      for (const [k, way] of [[contact.b, 1n], [contact.a, -1n]]) {
        rub[k] += timesUp(contact.h, over(rootUp(across2), contact.low));
        act(given[k], F, contact.inner[i], way);
      }
    });
  });
  const total = totals(model, loading, group, true);
  for (const [at, sum] of sizes) demand(100n * (sum << (2n * GUARD)) <= (BOUND * total.get(at)) ** 2n, () => `forces around block ${quoted(blocks[at].id)} are absurd`, { block: blocks[at].id });
  for (const { block, F } of loading.loads) rub[block] += L * rootUp(square(F));
  const left = blocks.map((block, k) => (block.fixed ? null : leftOn(block, given[k], loading.pulls[k], rub[k], L)));
  const above = blocks.map(() => []); // whose errors come down through each block's way
  blocks.forEach((block, k) => {
    let at = k;
    for (let steps = 0; at >= 0 && !blocks[at].fixed; steps++) {
      demand(steps <= blocks.length, "ways go round and do not lead to a support", { block: block.id });
      above[at].push(k);
      const way = contacts[model.ways[at]];
      at = way.a === at ? way.b : way.a;
    }
  });
  blocks.forEach((block, k) => { if (!block.fixed) passesOn(model, contacts[model.ways[k]], above[k].map((i) => ({ ...left[i], ...blocks[i] })), model.ways[k]); });
}

function isInner(contact, { u, v }, p, L) {
  const flat = (r) => [dot(r, u), dot(r, v)], { points, N, NN } = contact;
  return strictlyInside(flat(p), points.map(flat)) && points.every((r, i) => {
    const [n, d] = apart2(cross(sub(p, r), N), cross(sub(points[(i + 1) % points.length], r), N));
    return n >= L * L * NN * d;
  });
}

function leftOn(block, { F, T }, pull, rub, L) { // what a drawing may leave on a block; G is rho V' g, as far as V' goes
  const { V, Q } = changes(block, L), g = pull.map(size);
  const twist = [0, 1, 2].map((k) => Q[(k + 1) % 3] * g[(k + 2) % 3] + Q[(k + 2) % 3] * g[(k + 1) % 3]);
  return {
    pull, swell: 24n * V, // rho V' g is pull times this
    T: 24n * (isqrt(square(twist)) + 1n), U: rub + ceilDiv(rootUp(square(sub(times(T, block.q), cross(block.M, F)))), block.q), rF: rootUp(square(F)),
  };
}

function passesOn(model, contact, above, c) {
  const { N, NN, inner, F, low, high, h, mu1 } = contact, f = F.map((x) => dot(x, N)), P = f.reduce((x, y) => x + y, 0n);
  const fails = (why) => { throw new NotProved(`contact ${c}: ${why}`, { contact: c }); };
  if (P <= 0n) fails("it is a way, and bears nothing");
  const { u, v } = planeOf(contact), m = inner.reduce((sum, r, k) => add(sum, times(r, f[k])), ZERO); // the centre of pressure is m / P
  const arms = inner.map((r) => sub(times(r, P), m)).map((r) => [dot(r, u), dot(r, v)]);
  const [xx, xy, yy] = [[0, 0], [0, 1], [1, 1]].map(([i, j]) => arms.reduce((sum, r, k) => sum + f[k] * r[i] * r[j], 0n));
  const det = xx * yy - xy * xy, uu = square(u);
  if (det <= 0n) fails("its points are in one line");
  let wn = 0n, wt = 0n, t1 = 0n, t2 = 0n, tilt = 0n;
  for (const { pull, swell, T, U, rF, q, M } of above) {
    const arm = sub(times(M, P), times(m, q)); // times q P
    wn += over(size(dot(pull, N)) * swell, low) + rF;
    wt += over(ceilDiv(rootUp(square(cross(pull, N))) * swell, 1n << GUARD), low) + rF;
    t1 += ceilDiv(timesUp(rootUp(square(cross(pull, arm))), swell), q * P) + T;
    t2 += U + timesUp(rF, ceilDiv(rootUp(square(arm)), q * P));
    if (!isZero(pull)) tilt = most(tilt, over(rootUp(square(cross(pull, N))), isqrt(square(pull) * NN << (2n * GUARD)))); // |g x n| / |g|
  }
  const t = t1 + t2, tn = timesUp(t1, tilt) + t2;
  const S = [xx * NN + yy, P ** 3n * uu * NN]; // a fraction
  const rootS = isqrt((S[0] << (2n * GUARD)) / S[1]);
  if (rootS === 0n) fails("its points are in one place");
  const inPlane = t + timesUp(h, wt + over(tn, rootS));
  const push = floorDiv(P << (2n * GUARD), high);
  F.forEach((x, k) => {
    if (isZero(x)) return;
    const room = mu1 - over(rootUp(square(x) * NN - f[k] * f[k]), f[k] << GUARD);
    const [p, s] = [yy * arms[k][0] - xy * arms[k][1], xx * arms[k][1] - xy * arms[k][0]];
    const bend = ceilDiv(inPlane * rootUp(uu * (p * p + NN * s * s)) * P * P, det << GUARD); // |C^-1 rho| t'
    const arm = rootUp(ceilDiv((arms[k][0] ** 2n * NN + arms[k][1] ** 2n) << 64n, uu * NN)) / (P << 32n) + 1n;
    const turn = ceilDiv(timesUp(arm, tn) * S[1], S[0]);
    if (room < 0n || (push * room >> GUARD) < timesUp(mu1 + 1n, wn + bend) + wt + turn) fails(`point ${k}: what drawings within the length leave does not fit into its cone`);
  });
}

function checkMechanismWithin(model, own) {
  const { blocks, contacts, L } = model, group = components(model), loading = loadingAt(model), resisting = new Map();
  const motions = blocks.map((block, k) => (block.fixed ? { v: ZERO, w: ZERO } : model.unit.motion(model.motion[k])));
  const alike = (x, y) => isZero(sub(x.v, y.v)) && isZero(sub(x.w, y.w));
  const fixed = (k) => blocks[k].fixed;
  contacts.forEach((contact, c) => {
    const [a, b] = [motions[contact.a], motions[contact.b]], at = groupOf(model, group, contact);
    if (!alike(a, b) && !opensInAll(model, contact, sub(b.v, a.v), sub(b.w, a.w))) resisting.set(at, c);
  });
  const gain = new Map(), count = (k, x) => gain.set(group[k], (gain.get(group[k]) ?? 0n) + x), slight = leastOf(model, group, own);
  blocks.forEach((block, k) => {
    if (fixed(k)) return;
    const { v, w } = motions[k], { q, M } = block, pull = loading.pulls[k], path = add(times(v, q), cross(w, M)), { V, Q } = changes(block, L);
    count(k, dot(pull, path) << GUARD); // weight by the velocity of the centre
    count(k, -ceilDiv(24n * V * size(dot(pull, path)), q) - 24n * cross(pull, w).reduce((sum, x, i) => sum + Q[i] * size(x), 0n));
    const moved = ceilDiv(rootUp(square(path)), q) + rootUp(block.DD * square(w));
    count(k, -ceilDiv(timesUp(rootUp(slight.get(group[k])), moved), BALANCE));
  });
  for (const { block, F, at } of loading.loads) {
    const { v, w } = motions[block];
    count(block, (dot(F, add(v, cross(w, at))) << GUARD) - L * rootUp(square(cross(F, w))));
  }
  const falling = [...gain].filter(([, x]) => x > 0n).map(([at]) => at);
  demand(falling.length, "the loads do not drive this motion in every drawing");
  const bad = falling.map((at) => resisting.get(at));
  demand(bad.includes(undefined), () => `contact ${bad[0]} may resist in some drawing`, { contact: bad[0] });
}

function opensInAll(model, contact, v, w) {
  const { points, N, NN } = contact, plane = planeOf(contact), mu2 = leaning(model, contact, 1), low = rootDown(NN), one = 1n << GUARD;
  if (mu2 < 0n) return false;
  const corners = outline(points.map((r) => [dot(r, plane.u), dot(r, plane.v), r])).map(([, , r]) => r);
  const spin = timesUp(isqrt(one * one + mu2 * mu2) + 1n, rootUp(square(w)));
  return corners.every((r, i) => {
    const X = add(v, cross(w, r)), d = dot(X, N), C2 = square(X) * NN - d * d;
    const opens = floorDiv(d << (2n * GUARD), d < 0n ? low : low + 1n) - timesUp(mu2, over(rootUp(C2), low));
    const sides = [1, corners.length - 1].map((k) => cross(sub(corners[(i + k) % corners.length], r), N));
    const lengths2 = rootDown(square(sides[0]) * square(sides[1])), rest = lengths2 - (dot(...sides) << GUARD);
    if (rest <= 0n) return false;
    const z = (model.L << GUARD) + over(plane.height(r) << GUARD, plane.n * low);
    const e = isqrt(over(2n * model.L * model.L * (lengths2 + 1n) << GUARD, rest) + z * z) + 1n;
    return opens >= timesUp(spin, e);
  });
}

function outline(points) { // Andrew's monotone chain: corners of the convex hull, counter-clockwise
  const sorted = [...points].sort((a, b) => sign(a[0] - b[0]) || sign(a[1] - b[1]));
  const half = (list) => list.reduce((chain, p) => {
    while (chain.length > 1 && turn2(chain.at(-2), chain.at(-1), p) <= 0n) chain.pop();
    return [...chain, p];
  }, []).slice(0, -1);
  return [...half(sorted), ...half(sorted.reverse())];
}

// ---- Each kind, and what is claimed

const drawn = ({ within }) => `in every drawing within ${decimal(within.length)} m of this one, normals within ${within.slope === undefined ? "what that allows" : `${short(Math.atan(within.slope) * 180 / Math.PI)} degrees`} (listed contacts)`;
const PROOFS = {
  "rbe-state"(model, own, progress) {
    const { exact } = checkState(model, model.rows, loadingAt(model), own, { progress });
    return [`stable under rigid-block equilibrium`, grade(exact)];
  },
  "rbe-mechanism"(model, own, progress) {
    checkMechanism(model, model.motion, loadingAt(model), own, progress);
    return ["unstable under rigid-block equilibrium (listed contacts, associated flow)", ""];
  },
  "cra-state"(model, own, progress) {
    const { forces, exact } = checkState(model, model.rows, loadingAt(model), own, { corrected: false, progress });
    checkCoupling(model, forces, motionsOf(model, model.motion), own);
    return [`stable under coupled rigid-block analysis (${bounds(model)}, listed contacts)`, grade(exact)];
  },
  "cra-tree"(model, own, progress) {
    checkTree(model, progress);
    return [`unstable under coupled rigid-block analysis (${bounds(model)}, listed contacts)`, ""];
  },
  "limit-bounds"(model, own, progress) {
    const told = [];
    let exact = null;
    const live = loadingAt(model, 1, false);
    if (model.lower !== undefined) {
      exact = checkState(model, model.rows, loadingAt(model, model.lower), own, { progress }).exact;
      told.push(`forces hold it at ${decimal(model.lower)}${model.recession ? " and at every larger one" : ""}`);
    }
    let more = "";
    if (model.recession) {
      const light = lightest(model, live, own);
      const { exact: also } = checkState(model, model.recession, live, light, { pulls: false, what: "recession: " });
      if (!also) more = " (of the live loads, for each unit of their multiplier)";
      exact = exact && also;
    }
    if (model.upper !== undefined) {
      const fall = checkMechanism(model, model.motion, loadingAt(model, model.upper), own, progress);
      const work = workOf(model, live, fall.motions, fall.group), total = totals(model, live, fall.group, false);
      const grows = [...fall.falls].some(([at, norm]) => work.get(at) >= 0n && work.get(at) << GUARD >= BOUND * total.get(at) * norm);
      demand(grows, "the live loads drive no part that falls");
      told.push(`none hold it from ${decimal(model.upper)} on (listed contacts, associated flow)`);
    }
    return [`bounds of the live loads' multiplier under rigid-block equilibrium: ${told.join(", ")}`, exact === null ? "" : grade(exact) + more];
  },
  "rbe-settled"(model, own, progress) {
    const { forces, exact, group } = checkState(model, model.rows, loadingAt(model), own, { corrected: false, progress });
    checkSettling(model, forces, motionsOf(model, model.motion), own, group);
    return ["comes to rest after an infinitesimal settlement, under rigid-block equilibrium (listed contacts, associated flow)", grade(exact)];
  },
  "rbe-state-within"(model, own) {
    checkStateWithin(model, own);
    return [`stable under rigid-block equilibrium ${drawn(model)}`, ""];
  },
  "rbe-mechanism-within"(model, own) {
    checkMechanismWithin(model, own);
    return [`unstable under rigid-block equilibrium ${drawn(model)}`, ""];
  },
};

function lightest(model, live, own) { // w^2 of a recession
  const group = components(model), small = new Map();
  for (const { block, F } of live.loads) if (!isZero(F)) small.set(group[block], least(small.get(group[block]) ?? square(F), square(F)));
  return model.blocks.map((block, k) => {
    if (block.fixed) return null;
    const some = [square(weightOf(live, block, k)), small.get(group[k]) ?? 0n].filter((x) => x > 0n);
    return some.length ? some.reduce(least, own[k]) : 0n;
  });
}

const grade = (exact) => (exact ? "; every block balances exactly" : "; balancing loads that differ, on each block, by at most 1e-9 of its own weight");
function rounded(x, digits) { // as C's %g: of two that are as near the even one, where JavaScript takes the larger
  if (x === 0) return Object.is(x, -0) ? "-0" : "0";
  const [whole, below] = Math.abs(x).toExponential(80).split("e"), all = whole.replace(".", "");
  const tied = /^50*$/.test(all.slice(digits)) && all[digits - 1] % 2 === 0;
  const near = tied ? `${x < 0 ? "-" : ""}${whole.slice(0, digits + 1)}e${below}` : x.toExponential(digits - 1);
  const [lead, power] = near.split("e"), e = Number(power);
  if (e < -4 || e >= digits) return `${String(Number(lead))}e${e < 0 ? "-" : "+"}${String(Math.abs(e)).padStart(2, "0")}`;
  return Number(near).toFixed(Math.max(0, digits - 1 - e)).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");
}
const short = (x) => rounded(x, 6), decimal = (x) => rounded(x, 15);
const bounds = (model) => `eta = ${decimal(model.eta / model.eps)} eps, beta_min = ${decimal(model.beta_min / model.eps)} eps`;

function provisos(model) { // what would let a person expect more than is proved
  const { gravity, live, fit } = model, { blocks, contacts } = model.all ?? model, told = [];
  const partly = blocks.filter((block) => block.partly), mu = contacts.reduce((x, c) => Math.max(x, c.mu), 0);
  if ([gravity, live ? live.gravity : []].flat().every((x) => x === 0)) told.push("with zero gravity");
  if (blocks.every((block) => block.fixed)) told.push("no block is free");
  if (mu > SLIPPERY) told.push(`mu up to ${short(mu)}`);
  if (pyramids(contacts)) told.push(`COUNTING ON ${pyramids(contacts)}`);
  const pulls = contacts.filter((c) => c.tension).map((c) => c.tension);
  if (pulls.length) told.push(`COUNTING ON JOINTS THAT PULL: ${pulls.length} of ${contacts.length}, up to ${short(pulls.reduce(larger))} Pa`);
  const bent = contacts.filter((c) => c.surface === "rough" || c.surface === "curved").length, tips = contacts.filter((c) => c.surface === "point").length;
  if (bent || tips || fit?.lean > TOLD_LEAN || fit?.share > TOLD_SHARE) {
    const more = (x, what) => (x > 0 ? ` (${what.replace("%", rounded(x, 2))})` : "");
    told.push(`contacts up to ${rounded(fit.off, 2)} m off the faces${more(fit.gap, "gaps up to % m")}${more(fit.overlap, "faces up to % m into each other")}`);
    if (fit.lean > TOLD_LEAN) told.push(`leaning by up to ${rounded(fit.lean * 180 / Math.PI, 2)} degrees`);
    if (tips) told.push(`${tips} of them at corners and edges`);
    if (bent) told.push(`${bent} of them on surfaces said to be rough or curved`);
  }
  const several = blocks.filter((block) => block.pieces > 1).length, { found } = model.overlaps;
  if (several) told.push(`${several} block${several > 1 ? "s" : ""} of several detached pieces`);
  if (found.length) {
    const deepest = found.map(([depth]) => depth).reduce(larger), [depth, i, j] = found.find(([x]) => x >= deepest * (1 - 1e-9)), others = found.length - 1;
    const more = others ? ` (and ${others} more pair${others > 1 ? "s" : ""})` : "";
    told.push(`blocks ${quoted(blocks[i].id)} and ${quoted(blocks[j].id)} run into each other by ${rounded(depth, 3)} m${more}`);
  }
  return (partly.length ? ` (${partly.length} of ${blocks.length} blocks partly held)` : "") + told.map((what) => `, ${what}`).join("");
}

function span(values) {
  if (!values.length) return "none";
  const [low, high] = [smaller, larger].map((of) => values.reduce(of));
  return low === high ? short(low) : `${short(low)} to ${short(high)}`;
}

function pyramids(contacts) {
  const list = contacts.filter((c) => c.edges);
  if (!list.length) return "";
  const mu = list.flatMap(({ rays, N }) => rays.map((ray) => Math.sqrt(ratio(square(cross(ray, N)), dot(ray, N) ** 2n)))).reduce(larger);
  return `PYRAMIDS OF ${span(list.map((c) => c.edges.length))} EDGES for friction cones, up to mu ${short(mu > ROUNDED_MU ? mu : 0)}`;
}

function assumptions(model) { // what the proof takes as given, for a person to hold against the structure
  const { gravity, loads, live, tolerance, overlaps: { unseen } } = model, { blocks, contacts } = model.all ?? model;
  const free = blocks.filter((b) => !b.fixed), pulls = contacts.filter((c) => c.tension).map((c) => c.tension);
  const some = (list) => list.slice(0, 3).map((b) => shown(b.id)).join(", ") + (list.length > 3 ? ` and ${list.length - 3} more` : "");
  const triple = (v) => `(${v.map((x) => short(x + 0)).join(", ")})`, held = free.filter((b) => b.partly);
  const summed = (list) => (list.length ? `${list.length}, together ${triple([0, 1, 2].map((k) => sumOf(list.map((l) => l.force[k]))))} N` : "none beside the weight");
  const pairs = unseen === 1 ? "1 pair of blocks" : `${unseen} pairs of blocks`;
  return [
    ["blocks", `${blocks.length}, ${free.length} of them free`],
    ["supports", some(blocks.filter((b) => b.fixed)) || "none"],
    ["held", held.length ? `partly: ${some(held)}` : ""],
    ["contacts", `${contacts.length} listed, ${contacts.reduce((sum, c) => sum + c.points.length, 0)} points; nothing else touches`],
    ["friction", `mu ${span(contacts.map((c) => c.mu))}`],
    ["pyramids", pyramids(contacts)],
    ["tension", pulls.length ? `${pulls.length} of ${contacts.length} joints pull, ${span(pulls)} Pa` : ""],
    ["density", `${span(free.map((b) => b.density))} kg/m3`],
    ["gravity", `${triple(gravity)} m/s2, in size ${short(Math.hypot(...gravity))}`],
    ["loads", summed(loads.filter((load) => !blocks[load.block].fixed))],
    ["live", live ? `times the multiplier: gravity ${triple(live.gravity)} m/s2; loads ${summed(live.loads)}` : ""],
    ["tolerance", `contacts lie within ${rounded(tolerance, 3)} m of faces`],
    ["overlaps", unseen === null ? "of blocks were not looked at: none are assumed" : unseen ? `none of ${pairs}, not convex or of many faces, that were not looked at` : ""],
  ].filter(([, said]) => said);
}

function sumOf(values) { // rounded once
  const bits = bitsOf(values);
  return ratio(values.reduce((sum, x) => sum + toWhole(x, bits), 0n), 1n << BigInt(bits));
}

function verifyCertificate(text, progress = () => {}) {
  const no = (reason, where = null, kind = null, status = 1) => ({ proved: false, kind, claim: "", reason, where, assumed: [], status });
  let kind = null;
  try {
    if (text.length > LARGEST) throw new BadInput("no certificate: it is larger than a gibibyte");
    progress(0, "reading");
    const root = readJson(text);
    const schema = root instanceof Map ? root.get("schema") : null;
    if (typeof schema !== "string" || !schema.startsWith(FAMILY)) throw new BadInput("no certificate of cyclopean: its schema is missing or another");
    if (typeof root.get("kind") === "string") kind = root.get("kind").slice(0, 60);
    const model = readForm(text, root), all = model.all ?? model;
    toUnits(model);
    all.blocks.forEach((block, k) => { if (k % 64 === 0) progress(0.1 + 0.2 * k / all.blocks.length, "blocks"); measure(block); });
    all.contacts.forEach((contact, k) => { if (k % 64 === 0) progress(0.3 + 0.3 * k / all.contacts.length, "joints"); checkContact(model, contact); });
    checkPulls(model);
    loosenRidges(model);
    for (const contact of model.contacts) if (contact.tension) spreadPull(model, contact);
    model.overlaps = overlapsOf(model);
    const [said, worth] = PROOFS[kind](model, ownWeights(model), (share) => progress(0.6 + 0.4 * share, "proof"));
    progress(1, "done");
    return { proved: true, kind, claim: said + provisos(model) + worth, reason: "", where: null, assumed: assumptions(model), status: 0 };
  } catch (error) {
    if (error instanceof BadInput) return no(error.message, null, kind, 2);
    if (error instanceof NotProved) return no(error.message, error.where, kind);
    if (error instanceof RangeError) return no("it is too large for this checker: its numbers or lists do not fit", null, kind);
    throw error;
  }
}

if (typeof module !== "undefined") module.exports = { verifyCertificate, sha256, canonical, readJson };
