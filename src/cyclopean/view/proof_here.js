// The part of a page in which a proof is checked anew: what is embedded is unpacked, the checker runs in a worker.
// SPDX-License-Identifier: MIT. Copyright (c) 2026 The cyclopean authors.
"use strict";
(() => {
  const LARGEST = 64 << 20; // a page's memory holds the numbers of no larger file; Python's checker does
  const part = document.getElementById("proof-here");
  const [button, stop, file, drop] = ["check", "stop", "file", "drop"].map((name) => part.querySelector(`.${name}`));
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

  function show(result, source) {
    const list = document.createElement("dl");
    for (const [what, value] of result.assumed) list.append(element("dt", what), element("dd", value));
    const lines = result.proved
      ? [element("p", `${result.claim}.`), element("p", `Of ${source}, under these assumptions:`), list]
      : [element("p", `${result.reason}.`), element("p", `So nothing is proved by ${source}.`)];
    told.className = result.proved ? "stable" : "unstable";
    told.replaceChildren(element("strong", result.proved ? "Proved" : "Not proved"), ...lines);
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
    const answer = "onmessage=e=>postMessage({result:verifyCertificate(e.data,share=>postMessage({share}))})";
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
    mine.postMessage(text);
  }

  async function checkFile(given) {
    if (!given) return;
    const name = `the file ${given.name}`;
    if (given.size > LARGEST) { refuse("it holds more than 64 MB, too much for a page; cyclopean verify takes it", name); return; }
    try {
      await check(new TextDecoder("utf-8", { fatal: true, ignoreBOM: true }).decode(await given.arrayBuffer()), name);
    } catch {
      refuse("it cannot be read as text in UTF-8", name);
    }
  }

  stop.addEventListener("click", () => { end(); told.replaceChildren("Stopped."); });
  if (button) {
    button.addEventListener("click", () => {
      unpacked("certificate").then((text) => check(text, part.dataset.name)).catch(() => refuse("this browser cannot unpack it", part.dataset.name));
    });
  }
  if (file) {
    file.addEventListener("change", () => checkFile(file.files[0]));
    drop.addEventListener("dragover", (event) => { event.preventDefault(); drop.classList.add("over"); });
    drop.addEventListener("dragleave", () => drop.classList.remove("over"));
    drop.addEventListener("drop", (event) => {
      event.preventDefault();
      drop.classList.remove("over");
      checkFile(event.dataTransfer.files[0]);
    });
  }
})();
