// The part of a page in which a proof is checked anew: what is embedded is unpacked, the checker runs in a worker.
// SPDX-License-Identifier: MIT. Copyright (c) 2026 The cyclopean authors.
"use strict";
(() => {
  const LARGEST = 64 << 20; // a page's memory holds the numbers of no larger file; Python's checker does
  const part = document.getElementById("proof-here");
  const [button, stop] = ["check", "stop"].map((name) => part.querySelector(`.${name}`));
  const files = new Map(); // certificate and model, each {name, text}, as they are given
  const bar = part.querySelector("progress"), told = part.querySelector("[role=status]");
  let worker = null;

  const unpacked = async (name) => {
    const packed = Uint8Array.from(atob(document.getElementById(name).textContent), (c) => c.charCodeAt(0));
    return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"))).text();
  };

  const element = (name, text, ...inside) => {
    const made = document.createElement(name);
    made.append(text, ...inside);
    return made;
  };

  const list = (lines) => {
    const made = document.createElement("ul");
    made.append(...lines.map((line) => element("li", line)));
    return made;
  };

  function about(same, name) { // whether it is proved of the model that was given
    if (!same) return [];
    if (same.refused) return [element("p", `The model ${name} is not compared: ${same.refused}.`)];
    if (same.differences.length) return [element("p", `It is proved of other stones than those of the model ${name}:`), list(same.differences)];
    const open = same.open.length ? [element("p", "Only cyclopean verify --model compares:"), list(same.open)] : [];
    const found = same.open.length ? "says the same, as far as a page compares" : "has the same blocks, contacts and loads";
    return [element("p", `The model ${name} ${found}; it leaves open: ${same.assumed.join(", ")}.`), ...open];
  }

  function drawn({ shapes, size, spot }, where) { // far faces first, the joint or block that fails in red
    const svg = (name, values) => {
      const made = document.createElementNS("http://www.w3.org/2000/svg", name);
      for (const [key, value] of Object.entries(values)) made.setAttribute(key, value);
      return made;
    };
    const told = where ? "The blocks from the front and above; what fails is red" : "The blocks from the front and above";
    const picture = svg("svg", { viewBox: `-8 -8 ${+size[0] + 16} ${+size[1] + 16}`, role: "img", "aria-label": told });
    picture.append(...shapes.map(({ points, mark }) => svg("polygon", { points, class: mark })));
    if (spot) picture.append(svg("circle", { cx: spot[0], cy: spot[1], r: 7, class: "fails" }));
    return picture;
  }

  function show(result, source) {
    const assumed = document.createElement("dl");
    for (const [what, value] of result.assumed) assumed.append(element("dt", what), element("dd", value));
    const other = result.model?.differences?.length > 0, title = other ? "Proved, but not of this model" : result.proved ? "Proved" : "Not proved";
    const lines = result.proved
      ? [element("p", `${result.claim}.`), ...about(result.model, files.get("model")?.name), element("p", `Of ${source}, under these assumptions:`), assumed]
      : [element("p", `${result.reason}.`), element("p", `So nothing is proved by ${source}.`)];
    if (result.outline && (!button || result.where)) lines.push(drawn(result.outline, result.where));
    told.className = result.proved && !other ? "stable" : "unstable";
    told.replaceChildren(element("strong", title), ...lines);
  }

  function end() {
    if (worker) worker.terminate();
    worker = null;
    bar.hidden = stop.hidden = true;
    if (button) button.disabled = false;
  }

  const refuse = (reason, source) => { end(); show({ proved: false, reason, assumed: [] }, source); };

  async function check(text, source) {
    end();
    told.className = "";
    told.replaceChildren("Checking ...");
    bar.value = 0;
    bar.hidden = stop.hidden = false;
    if (button) button.disabled = true;
    const answer = `onmessage = ({ data: { text, model } }) => {
      const result = verifyCertificate(text, (share) => postMessage({ share }));
      result.outline = outlineOf(text, result.where);
      if (result.proved && model) result.model = compareModel(text, model);
      postMessage({ result });
    }`;
    const address = URL.createObjectURL(new Blob([await unpacked("checker"), answer], { type: "text/javascript" }));
    const mine = worker = new Worker(address);
    URL.revokeObjectURL(address);
    mine.onmessage = ({ data }) => {
      if (mine !== worker) return;
      if (!data.result) { bar.value = data.share; return; }
      end();
      show(data.result, source);
    };
    mine.onerror = (event) => { event.preventDefault(); if (mine === worker) refuse("the checker could not go on: out of memory, or a fault of its own", source); };
    mine.postMessage({ text, model: files.get("model")?.text });
  }

  async function take(what, given) {
    if (!given) return;
    const name = `the file ${given.name}`;
    files.delete(what);
    if (given.size > LARGEST) { refuse("it holds more than 64 MB, too much for a page; cyclopean verify takes it", name); return; }
    try {
      files.set(what, { name: given.name, text: new TextDecoder("utf-8", { fatal: true, ignoreBOM: true }).decode(await given.arrayBuffer()) });
    } catch {
      refuse("it cannot be read as text in UTF-8", name);
      return;
    }
    const proof = files.get("certificate");
    if (proof) await check(proof.text, `the file ${proof.name}`).catch(() => refuse("this browser cannot run the checker", name));
    else told.replaceChildren("The model is there; a certificate is to come.");
  }

  stop.addEventListener("click", () => { end(); told.replaceChildren("Stopped."); });
  if (button) {
    button.addEventListener("click", () => {
      unpacked("certificate").then((text) => check(text, part.dataset.name)).catch(() => refuse("this browser cannot unpack it", part.dataset.name));
    });
  }
  for (const drop of part.querySelectorAll(".drop")) {
    const input = drop.querySelector("input");
    input.addEventListener("click", () => { input.value = ""; }); // the same file again may be another by now
    input.addEventListener("change", () => take(input.name, input.files[0]));
    drop.addEventListener("dragover", (event) => { event.preventDefault(); drop.classList.add("over"); });
    drop.addEventListener("dragleave", () => drop.classList.remove("over"));
    drop.addEventListener("drop", (event) => {
      event.preventDefault();
      drop.classList.remove("over");
      take(input.name, event.dataTransfer.files[0]);
    });
  }
})();
