// The page: what is chosen becomes a clip, which plays until the next one.
"use strict";
(async () => {
  const byId = name => document.getElementById(name);
  const about = JSON.parse(byId("about").textContent), { meta, figure } = about, parents = meta.skeleton.parents;
  const asked = new URLSearchParams(location.hash.slice(1));
  const number = (name, otherwise) => asked.has(name) && isFinite(asked.get(name)) ? Number(asked.get(name)) : otherwise;
  const [search, seed, seconds, guidance] = ["search", "seed", "seconds", "guidance"].map(byId);
  const content = async name => {  // what the page holds under a name
    const item = byId(name), packed = await fetch("data:application/octet-stream;base64," + item.textContent);
    item.remove();
    return new Response(packed.body.pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
  };

  // the actions: a list that is searched in names and in what people said of the clips
  const items = meta.actions.map((name, index) => {
    const label = document.createElement("label"), radio = Object.assign(document.createElement("input"), { type: "radio", name: "action", value: index });
    label.append(radio, name);
    label.hidden = meta.active !== undefined && !meta.active[index].length;  // the data has no clip of it
    byId("actions").append(label);
    return { label, radio, absent: label.hidden, name: name.toLowerCase(), words: about.words[index].toLowerCase() };
  });
  const chosen = () => Number(document.querySelector("[name=action]:checked").value);
  const shown = () => items.filter(item => !item.label.hidden);
  const choose = item => { item.radio.checked = true; item.label.scrollIntoView({ block: "nearest" }); make(); };
  search.oninput = () => {
    const parts = search.value.toLowerCase().split(/\s+/).filter(Boolean), has = kind => item => parts.every(part => item[kind].includes(part));
    const named = items.filter(has("name"));
    const found = new Set(named.length ? named : items.filter(has("words")));
    for (const item of items) item.label.hidden = item.absent || !found.has(item);
    byId("found").textContent = parts.length ? `${shown().length} of ${items.length}` : `${items.length}`;
  };
  // several actions in a row: those before the chosen one, each with its seconds; words as prompts have them become such a row
  const before = [], MOST = 12;
  const showParts = () => byId("parts").replaceChildren(...before.map((part, index) => {
    const chip = Object.assign(document.createElement("button"), { type: "button", textContent: `${meta.actions[part.action]} ${part.seconds} s \u00d7` });
    chip.title = "take it out";
    chip.onclick = () => { before.splice(index, 1); showParts(); make(); };
    return chip;
  }));
  const nearest = words => {
    const text = words.toLowerCase().trim(), has = kind => items.findIndex(item => !item.absent && text.split(/\s+/).every(part => item[kind].includes(part)));
    const exact = items.findIndex(item => !item.absent && item.name === text), named = exact < 0 ? has("name") : exact;
    return named < 0 ? has("words") : named;
  };
  function prompt(text) {  // "walk for 2 s, then jump": whether all of it was understood
    const parts = text.split(/\s*(?:[,;]\s*(?:and\s+)?then\b|[,;]|\bthen\b)\s*/i).filter(Boolean).map(part => {
      const [, words, long] = /^(.*?)(?:\s+for\s+(\d+(?:\.\d+)?)\s*(?:s|sec|seconds?))?$/i.exec(part.trim());
      return { action: nearest(words), seconds: Math.min(30, Math.max(1, Number(long) || Number(seconds.value))), words };
    });
    const lost = parts.find(part => part.action < 0);
    if (lost || !parts.length || parts.length > MOST) {
      byId("told").textContent = lost ? `No action of this page is called "${lost.words}".` : `Give 1 to ${MOST} actions.`;
      return;
    }
    const last = parts.pop();
    before.splice(0, Infinity, ...parts);
    showParts();
    search.value = "";
    search.oninput();
    seconds.value = last.seconds;
    choose(items[last.action]);
  }
  byId("then").onclick = () => {
    if (before.length + 1 < MOST) before.push({ action: chosen(), seconds: Number(seconds.value) });
    showParts();
    make();
    search.focus();
  };

  search.onkeydown = event => {
    if (event.key === "Enter" && /,|;|\bthen\b|\bfor\s+\d/i.test(search.value)) { event.preventDefault(); prompt(search.value); return; }
    const first = shown()[0];
    if (!first || !["Enter", "ArrowDown"].includes(event.key)) return;
    event.preventDefault();
    choose(first);
    if (event.key === "ArrowDown") first.radio.focus();
  };

  const stand = makeStage(byId("stage"), { azimuth: number("azimuth", 30), elevation: number("elevation", 8), distance: 4.4 });
  let who, clip = null, running = !asked.has("time"), now = number("time", 0), wanted = 0;
  const sampling = async () => {
    const [engine, loader, model] = await Promise.all(["engine", "loader", "model"].map(content));
    Object.assign(ort.env.wasm, { numThreads: 1, proxy: false, wasmBinary: engine });
    ort.env.wasm.wasmPaths = { mjs: URL.createObjectURL(new Blob([loader], { type: "text/javascript" })) };
    return makeSampler(await ort.InferenceSession.create(new Uint8Array(model), { executionProviders: ["wasm"], graphOptimizationLevel: "basic" }), meta);
  };
  const somebody = async () => figure.bones ? makeCharacter(stand.scene, await content("character"), figure) : makeSticks(stand.scene, { parents, ...figure });

  const feet = makeFeet({ ...meta.feet, fps: meta.fps, parents });
  window.a2v = { sample: wish => sample(wish), figure: () => who, clip: async () => ({ ...clip, fps: meta.fps }) };  // for what looks into the page from outside; see sample.js and figure.js
  const wish = () => ({
    labels: [...before, { action: chosen(), seconds: seconds.value }].flatMap(part => new Array(Math.max(1, Math.round(part.seconds * meta.fps))).fill(part.action)),
    guidance: Number(guidance.value), seed: Math.max(0, Math.floor(seed.value) || 0),
  });
  async function make() {
    const mine = ++wanted, asking = wish(), began = performance.now();
    byId("seconds-told").textContent = `${Number(seconds.value)} s`;
    byId("guidance-told").textContent = guidance.value;
    while (make.busy) await make.busy;  // one clip at a time, and of those that wait the last
    if (mine !== wanted) return;
    make.busy = sample(asking);
    const made = await make.busy.finally(() => { make.busy = null; });
    if (mine !== wanted) return;
    const joints = feet(made, asking.labels), took = performance.now() - began;
    clip = { joints, parents, last: joints.length / (3 * parents.length) - 1 };
    who.begin(clip);
    if (running) now = 0;
    remember();
    tell(asking, took);
  }
  const named = part => `${meta.actions[part.action].toLowerCase()}:${part.seconds}`;
  function remember() {  // the address tells what is shown, for whoever it is sent to
    const said = new URLSearchParams({ action: meta.actions[chosen()].toLowerCase(), seconds: seconds.value, seed: seed.value });
    for (const part of before) said.append("before", named(part));
    if (meta.guidance && Number(guidance.value) !== meta.guidance) said.set("guidance", guidance.value);
    history.replaceState(null, "", `#${said}`);
  }
  const fileName = () => meta.actions[chosen()].toLowerCase().replace(/[^a-z0-9]+/g, "-");
  byId("save-bvh").onclick = () => download(bvhOf(framesOf(clip, meta.fps), meta.skeleton), `${fileName()}.bvh`, "text/plain");
  byId("save-glb").onclick = () => download(glbOf(framesOf(clip, meta.fps), meta.actions[chosen()], who), `${fileName()}.glb`, "model/gltf-binary");
  byId("share").onclick = async () => {
    try { await navigator.clipboard.writeText(location.href); byId("share").textContent = "Copied"; } catch { byId("told").textContent = location.href; }
    setTimeout(() => { byId("share").textContent = "Copy address"; }, 2000);
  };
  function tell(asking, took) {
    const name = meta.actions[chosen()], quoted = /^[\w-]+$/.test(name) ? name : `"${name}"`;
    const same = !meta.guidance || asking.guidance === meta.guidance;
    if (before.length) {
      byId("told").textContent = `${before.length + 1} actions, made in ${Math.round(took)} ms.`;
      return;
    }
    byId("told").textContent = `${name}, made in ${Math.round(took)} ms.` + (same ? " As a file: " : " Guidance is not the model's own: files take what it was exported with.");
    if (!same) return;
    const code = document.createElement("code");
    code.textContent = `a2v motion --model ${about.model} --action ${quoted} --seed ${asking.seed} --seconds ${Number(seconds.value)} --out clip.bvh`;
    byId("told").append(code);
  }

  const play = byId("play"), slider = byId("time"), clock = new THREE.Clock();
  const start = on => { running = on; play.textContent = on ? "Pause" : "Play"; };
  play.onclick = () => start(!running);
  slider.oninput = () => { start(false); now = slider.value * length(); };
  const length = () => Math.max(clip.last, 1e-6) / meta.fps;
  const frame = () => {
    const passed = clock.getDelta();
    if (running) now = (now + passed) % length();
    now = Math.min(now, length());
    who.pose(poseAt(clip.joints, parents, now * meta.fps));
    slider.value = now / length();
    const far = stand.center.distanceTo(who.where) > 3;
    stand.draw(who.where, running && !far ? 1 - Math.exp(-4 * passed) : 1);
    requestAnimationFrame(frame);
  };

  let sample;
  try {
    [sample, who] = await Promise.all([sampling(), somebody()]);
    seed.value = number("seed", about.seed);
    seconds.value = number("seconds", about.seconds);
    guidance.value = number("guidance", meta.guidance || 1);
    byId("guidance-row").hidden = !meta.guidance;
    for (const part of asked.getAll("before").slice(0, MOST - 1)) {
      const [, name, long] = /^(.*):(\d+(?:\.\d+)?)$/.exec(part) || [], action = items.findIndex(item => !item.absent && item.name === name);
      if (action >= 0) before.push({ action, seconds: Math.min(30, Math.max(1, Number(long))) });
    }
    showParts();
    const shownFirst = items.find(item => item.name === (asked.get("action") || "").toLowerCase());
    const first = shownFirst || items[about.action] || items.find(item => !item.absent);
    first.radio.checked = true;
    search.oninput();
    first.label.scrollIntoView({ block: "nearest" });
    for (const item of [byId("actions"), seed, seconds, guidance]) item.oninput = make;
    byId("another").onclick = () => { seed.value = Math.floor(1e6 * Math.random()); make(); };
    await make();
    stand.fit(1.05);
    stand.show();
    start(running);
    frame();
    document.body.dataset.state = "ready";
    document.body.dataset.ready = performance.now().toFixed(0);  // ms since the page was opened
  } catch (error) {
    document.body.dataset.state = "failed";
    byId("message").textContent = "This browser cannot make motions: " + (error && error.message || error);
  }
})();
