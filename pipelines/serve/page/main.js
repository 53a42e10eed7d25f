// The page: people, what they do, and the state of the server, which it requests repeatedly; text from outside never becomes markup.
import { unpacked } from "./actor.js";
import { Camera } from "./camera.js";
import { Clip } from "./clip.js";
import { Exporter } from "./export.js";
import { Films } from "./films.js";
import { Gallery, loadFigures } from "./gallery.js";
import { simpler } from "./ground.js";
import { liveControls } from "./live.js";
import { Motions } from "./motions.js";
import { Performance } from "./performance.js";
import { PhotoPanel, gradeOf } from "./photo.js";
import { Stage } from "./stage.js";
import { ask, byId, duration, make, say, size } from "./tools.js";

const SAMPLE = "sample", SHAPES = ["body", "surface", "textured"], STEPS = ["outline", ...SHAPES, "moving"];
const WORDS = { outline: "Outline", body: "Body", surface: "Surface", textured: "Colors", moving: "Alive" };
const MOST_POINTS = 20, KEPT = 40, HOVER = 140;
const LONG = 2;  // seconds of a motion whose beginning is asked for first
const PREPARED = 60000;  // milliseconds for which the server stays prepared for a photo
const PAUSE = 250;  // milliseconds from the beginning until the whole is asked for
const GRAVE = /expect a wrong|not understood|does not match/;
const still = matchMedia("(prefers-reduced-motion: reduce)");
let choices = null, state = { photos: [], jobs: [], motions: [] }, stage = null;
let chosen = new URLSearchParams(location.hash.slice(1)).get("photo") || SAMPLE;
let answered = false;  // whether the server has told its state
let onStage = "";  // whose person stands on the stage
let formed = "";  // which stages of which photo were shown

const photoOf = id => state.photos.find(photo => photo.id === id);
const acting = () => (onStage === SAMPLE || onStage === chosen ? onStage : "");  // who can act now

/** Bring a person on the stage; `way` is how the address changes, so that "back" leads to the one before. */
function choose(id, way = "replaceState") {
  if (way && id !== chosen) history[way](null, "", id === SAMPLE ? location.pathname : `#photo=${id}`);
  chosen = id;
  say(byId("problem"), "");
  showPeople();
}

// --- photos

async function upload(blob, name) {
  if (!blob) return;
  if (motions.holds(blob)) return motions.take(blob, byId("problem"));
  if (blob.type.startsWith("video/")) return clip.take(blob, byId("problem"));
  if (blob.type && !blob.type.startsWith("image/")) return refuse("This is no photo, video or motion. Choose a JPEG or PNG of one person.");
  if (choices && blob.size > choices.upload) return refuse(`This is larger than ${choices.upload >> 20} MB; choose a smaller photo.`);
  await send(`api/photos?name=${encodeURIComponent(name || "photo")}`, { method: "POST", body: blob });
}

/** A photo that cannot be used replaces the one before: nothing of that stays in sight. */
function refuse(text) {
  choose(SAMPLE);
  say(byId("problem"), text);
}

async function send(address, how) {
  say(byId("problem"), "");
  say(byId("forgotten"), "");
  document.body.classList.add("busy");
  byId("doing").textContent = "Opening the photo…";
  let photo = null;
  try {
    photo = await ask(address, how);
    asked += 1;  // an answer under way does not know this photo
    state.photos.push(photo);
    choose(photo.id, "pushState");
    poll();
  } catch (error) { refuse(error.message); }
  byId("doing").textContent = "";
  document.body.classList.remove("busy");
  return photo;
}

let drawn = "";
function showPeople() {
  if (!answered && chosen !== SAMPLE) return;  // the server has not told yet who is here
  if (chosen !== SAMPLE && !photoOf(chosen)) chosen = SAMPLE;
  const now = JSON.stringify([chosen, state.photos]);
  if (now === drawn) return;
  drawn = now;
  const face = (id, title, picture) => {
    const button = make("button", { type: "button", title });
    button.setAttribute("aria-pressed", id === chosen);
    button.setAttribute("aria-label", title);
    button.append(picture ? make("img", { src: picture, alt: "" }) : "…");
    button.onclick = () => choose(id, "pushState");
    return button;
  };
  byId("people").replaceChildren(face(SAMPLE, "the sample person", "page/sample.webp"),
    ...[...state.photos].reverse().map(photo => face(photo.id, photo.title, photo.width ? `photos/${photo.id}/photo.jpg` : "")));
  const photo = photoOf(chosen);
  panel.show(photo || null);
  byId("export").disabled = Boolean(photo && photo.status === "unusable");
  byId("who").textContent = photo ? photo.title : "Sample person";
  clip.show(photo || null);
  showLive(photo);
  showMaking(photo);
  if (stage) bring(photo);
}
let live = null, driven = "";

/** The controls of the live mode. They stay while the same person is driven, also when a recording is added to the files. */
function showLive(photo) {
  const now = JSON.stringify([chosen, Boolean(stage), photo && [photo.known, photo.looks, photo.more]]);
  if (now === driven) return;
  driven = now;
  if (live) live.stop();
  live = liveControls(byId("live-box"), chosen, stage, () => Boolean(photo && photo.known), () => poll());
}

/** What is known about the photo, and how far the person is. */
function showMaking(photo) {
  const busy = photo && photo.status !== "unusable" && !photo.known, box = byId("making");
  box.hidden = !busy;
  const told = photo ? [...new Set([...photo.warnings, ...photo.notes])] : [], grave = told.filter(text => GRAVE.test(text));
  const grade = photo && photo.status === "ready" ? [gradeOf(photo)] : [], notes = [...grave, ...grade, ...told.filter(text => !grave.includes(text))].slice(0, 4);
  const remedied = notes.find(text => !grade.includes(text));
  byId("warnings").replaceChildren(...notes.map(text => {
    const item = make("li", {}, text[0].toUpperCase() + text.slice(1));
    if (photo.status === "ready" && text === remedied) {
      const several = photo.people.length > 1, remedy = make("button", { type: "button" }, several ? "Choose the person" : "Correct");
      remedy.onclick = () => { if (several) { byId("person").open = true; byId("seen").scrollIntoView({ block: "center" }); } else panel.correct(); };
      item.append(" ", remedy);
    }
    return item;
  }));
  if (photo && photo.status === "unusable") say(byId("problem"), photo.problem[0].toUpperCase() + photo.problem.slice(1));
  if (!busy) return;
  const shown = photo.progress && photo.progress.shown || [], last = photo.status === "looking" ? -1 : Math.max(0, ...SHAPES.map((name, index) => shown.includes(name) ? index + 1 : 0));
  byId("making-text").textContent = photo.status === "looking" ? "Looking for the person" : photo.progress ? photo.progress.stage : "Waiting for its turn";
  byId("making-left").textContent = photo.progress && photo.progress.left ? `about ${duration(photo.progress.left)} left` : "";
  if (photo.progress) byId("making-bar").value = photo.progress.share; else byId("making-bar").removeAttribute("value");
  byId("making-stages").replaceChildren(...STEPS.map((name, index) => {
    const item = make("li", { className: index <= last ? "made" : "" }, WORDS[name]);
    if (index === last + 1) item.setAttribute("aria-current", "step");
    return item;
  }));
}

/** Bring the chosen person on the stage, as far as it is made. */
async function bring(photo) {
  const id = photo ? photo.id : SAMPLE, version = photo ? `${id} ${photo.looks} ${photo.more.length}` : SAMPLE;
  if (!photo || photo.known) {
    if (onStage === id && bring.version === version) return;
    const turn = bring.turn = (bring.turn || 0) + 1;
    bring.version = version;
    const address = photo ? `photos/${id}/person.glb?${photo.looks}${photo.more.join("")}` : "page/person.glb";
    try { if (!(await stage.show(address, () => turn === bring.turn))) return; } catch (error) { bring.version = ""; return say(byId("problem"), `The person cannot be shown: ${error.message}`); }
    const other = onStage !== id;
    onStage = id;
    formed = "";
    kept.clear();
    document.body.dataset.person = id;
    if (other || performance_.parts.length) perform();
    return;
  }
  bring.turn = (bring.turn || 0) + 1;
  bring.version = "";
  onStage = "";
  delete document.body.dataset.person;
  if (photo.status === "unusable") { stage.clearShapes(); formed = ""; return bring(null); }
  const shown = SHAPES.filter(name => photo.progress && (photo.progress.shown || []).includes(name)).at(-1);
  const now = `${id} ${photo.status} ${photo.looks} ${shown || ""}`;
  if (now === formed || !photo.width) return;
  const same = formed.startsWith(`${id} ready ${photo.looks}`);
  formed = now;
  if (!same) stage.card({ address: `photos/${id}/photo.jpg`, width: photo.width, height: photo.height }, photo.status === "ready" ? `photos/${id}/mask.png?${photo.looks}` : "");
  if (shown) await stage.form(`photos/${id}/stage_${shown}.bin?${Date.now()}`).catch(() => {});
}

/** A photo is about to come: the server loads what finds people. */
function prepare() {
  if (performance.now() < prepare.until) return;
  prepare.until = performance.now() + PREPARED;
  ask("api/prepare", { method: "POST" }).catch(() => {});
}
prepare.until = 0;
for (const item of [document.querySelector("label[for=file]"), byId("file"), byId("camera")]) for (const name of ["pointerenter", "focus", "click"]) item.addEventListener(name, prepare);
byId("file").onchange = () => { const [file] = byId("file").files; upload(file, file && file.name); byId("file").value = ""; };
for (const name of ["dragover", "drop", "dragleave"]) {
  document.addEventListener(name, event => {
    if (!event.dataTransfer || ![...event.dataTransfer.types].includes("Files")) return;
    event.preventDefault();
    if (name === "dragover") prepare();
    byId("drop").classList.toggle("over", name === "dragover");
    const dropped = name === "drop" && event.dataTransfer.files[0];
    if (dropped) upload(dropped, dropped.name);
  });
}
document.addEventListener("paste", event => {
  const pasted = [...event.clipboardData.files].find(item => item.type.startsWith("image/"));
  if (pasted) upload(pasted, pasted.name);
});
const panel = new PhotoPanel({
  poll: () => poll(), limits: () => choices, refuse: text => say(byId("problem"), text),
  forgotten: (gone, videos) => {
    choose(SAMPLE);
    const results = gone.calls ? `, ${gone.calls} kept results (${size(gone.bytes)})` : "";
    say(byId("forgotten"), `Deleted: the photo${videos ? `, ${videos} film${videos > 1 ? "s" : ""}` : ""}${results}. Downloaded files are not deleted.`);
  },
  films: id => state.jobs.filter(job => job.photo === id).length,
});
const clip = new Clip(() => photoOf(chosen), () => choices, () => poll(), copied => { performance_.copy(copied); });
const motions = new Motions(() => choices, () => poll(), copied => { performance_.copy(copied); });
new Camera(byId("camera"), blob => upload(blob, "camera"));

// --- what the person does

const performance_ = new Performance(() => perform());
const kept = new Map();  // motions by who does what

/** What a person does, or its `first` second, which the server sends sooner. */
async function motionOf(wish, first = false) {
  const who = acting(), key = JSON.stringify([who, wish, first]);
  if (!kept.has(key)) {
    const told = ask(`api/people/${who}/play`, { method: "POST", body: JSON.stringify({ wish, first }) });
    kept.set(key, told.then(unpacked).then(motion => ({ ...motion, short: first })));
    if (kept.size > KEPT) kept.delete(kept.keys().next().value);
  }
  try { return await kept.get(key); } catch (error) { kept.delete(key); throw error; }
}

/** Whether the beginning of a motion is asked for before the whole. */
function begins(wish) {
  return !wish.clip && !wish.motion && wish.seconds >= LONG && !kept.has(JSON.stringify([acting(), wish, false]));
}

/** Let the whole follow its beginning, unless something else is wanted meanwhile. */
async function lengthen(first, wish, own) {
  await new Promise(done => setTimeout(done, PAUSE));
  if (own !== turn) return;
  try { stage.lengthen(first, await motionOf(wish)); } catch (error) { if (own === turn) say(byId("act-problem"), error.message); }
}

let turn = 0;

/** Whether the server works for the stage, which draws less meanwhile. */
function working(on) {
  if (on) byId("stage").setAttribute("aria-busy", "true"); else byId("stage").removeAttribute("aria-busy");
  if (stage) stage.pace.rest(on);
}

async function perform(wish = performance_.wish(), hovering = false) {
  const own = ++turn, problem = byId("act-problem");
  byId("takes").hidden = true;
  if (!hovering) { say(problem, ""); stage && stage.showPath(performance_.path.length ? performance_.path : []); }
  if (!stage || !acting()) return;
  working(false);
  if (!wish) { byId("doing").textContent = ""; if (stage.acting !== stage.waiting) stage.wait(); return; }
  working(true);
  if (wish.clip) byId("doing").textContent = "Copying the motion of the video…";
  try {
    const motion = await motionOf(wish, begins(wish));
    if (own !== turn) return;
    if (!hovering) stage.plays = true;
    stage.act(motion);
    if (motion.short) lengthen(motion, wish, own);
    byId("doing").textContent = hovering ? "" : performance_.words();
    document.body.dataset.acts = Number(document.body.dataset.acts || 0) + 1;
  } catch (error) { if (own === turn) { byId("doing").textContent = ""; say(problem, error.message); } }
  if (own === turn) working(false);
}

/** Four takes beside each other; one of them is chosen on the stage, by a button or a number. */
async function compare() {
  const own = ++turn, wishes = performance_.takes(), box = byId("takes"), seeds = wishes.map(wish => wish.seed);
  if (!stage || !acting()) return;
  say(byId("act-problem"), "");
  working(true);
  try {
    const motions = await Promise.all(wishes.map(wish => motionOf(wish)));
    if (own !== turn) return;
    const choose = index => performance_.change(performance_.inTake(seeds[index]));
    stage.plays = true;
    await stage.compare(motions, choose);
    byId("doing").textContent = "Press the take that you want";
    box.replaceChildren(...seeds.map((seed, index) => make("button", { type: "button", onclick: () => choose(index) }, index ? `Take ${seed + 1}` : `Take ${seed + 1} (now)`)));
    box.hidden = false;
    document.body.dataset.takes = motions.length;
  } catch (error) { if (own === turn) say(byId("act-problem"), error.message); }
  if (own === turn) working(false);
}
byId("compare").onclick = compare;

const gallery = new Gallery(byId("actions"), entry => { clearTimeout(gallery.timer); performance_.add(entry, byId("append").checked); }, entry => {
  clearTimeout(gallery.timer);
  if (still.matches || !byId("hover").checked || !stage || !stage.plays) return;
  if (entry) gallery.timer = setTimeout(() => perform(performance_.alone(entry), true), HOVER);
  else gallery.timer = setTimeout(() => perform(), HOVER);
});

const action = byId("action"), understood = byId("understood");
let reading = 0, typing;
async function read() {
  const own = ++reading, text = action.value.trim();
  understood.className = "understood";
  say(byId("unkept"), "");
  gallery.show(choices.actions, text, byId("theme").value);
  if (!text) { understood.textContent = ""; return; }
  try {
    const found = await ask("api/words", { method: "POST", body: JSON.stringify({ text }) });
    if (own !== reading) return;
    understood.classList.add("good");
    understood.textContent = `Understood: ${found.parts.map(part => [part.title, ...part.wishes.filter(wish => wish.kept).map(wish => wish.text)].join(", ")).join("; then ")}`;
    say(byId("unkept"), found.parts.flatMap(part => part.wishes).filter(wish => !wish.kept).map(wish => `Not kept: ${wish.text}${wish.why ? ` (${wish.why})` : ""}.`).join(" "));
    performance_.set(found.parts, text);
  } catch (error) {
    if (own !== reading) return;
    understood.classList.add("bad");
    understood.textContent = error.message;
  }
}
byId("theme").onchange = () => gallery.show(choices.actions, action.value, byId("theme").value);
action.oninput = () => { clearTimeout(typing); typing = setTimeout(read, 350); };
action.onkeydown = event => { if (event.key === "Enter") { clearTimeout(typing); read(); } };

// --- the stage's own controls

function showPlay() {
  byId("play").textContent = stage && stage.plays ? "❚❚" : "▶";
  byId("play").setAttribute("aria-label", stage && stage.plays ? "pause" : "play");
}
byId("play").onclick = () => { if (stage) stage.plays = !stage.plays; };
for (const button of document.querySelectorAll("[data-azimuth]")) button.onclick = () => { if (stage) stage.lookFrom({ azimuth: Number(button.dataset.azimuth), elevation: 4 }); };
byId("face").onclick = () => { if (stage) { stage.close = !stage.close; stage.lookFrom({}); byId("face").setAttribute("aria-pressed", stage.close); } };
byId("light").onchange = () => { if (stage) stage.look = byId("light").value; };
byId("speak").onclick = () => { const text = byId("line").value.trim(); if (text && stage) { stage.say(text); document.body.dataset.spoken = text; } };
byId("line").onkeydown = event => { if (event.key === "Enter") byId("speak").click(); };
byId("draw").onclick = () => {
  if (!stage) return;
  const on = !stage.drawing;
  byId("draw").setAttribute("aria-pressed", on);
  byId("stage").classList.toggle("draws", on);
  if (on && stage.view.elevation < 35) stage.lookFrom({ elevation: 45 });
  stage.drawing = on ? points => {
    byId("draw").click();
    const [x, , z] = stage.place;
    let line = simpler(points.map(point => [point[0] - x, point[1] - z]));
    while (line.length > MOST_POINTS) line = line.filter((point, index) => index % 2 === 0 || index === line.length - 1);
    performance_.setPath(line.length > 1 ? line : []);
  } : null;
};
document.addEventListener("keydown", event => {
  const item = event.target, typed = item.closest("input, select, textarea, dialog, video, summary"), pressed = item.closest("button, a, label, [role=tab]");
  if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z" && !typed) { event.preventDefault(); performance_.undo(); return; }
  if (event.ctrlKey || event.metaKey || event.altKey || typed || !stage) return;
  const take = byId("takes").hidden ? null : byId("takes").children[Number(event.key) - 1];
  if (take) take.click();
  else if (event.key >= "1" && event.key <= "9") gallery.press(Number(event.key) - 1);
  else if (event.key === " " && !pressed) { event.preventDefault(); byId("play").click(); }
  else if (item.closest("#stage, body") && !item.closest("#actions, #chips")) {
    const move = { ArrowLeft: [12, 0], ArrowRight: [-12, 0], ArrowUp: [0, 6], ArrowDown: [0, -6] }[event.key];
    if (move && (item.id === "stage" || item === document.body)) { event.preventDefault(); stage.turn(...move); }
    if (item.id === "stage" && (event.key === "+" || event.key === "-")) stage.zoom(event.key === "+" ? 0.87 : 1.15);
  }
});

// --- exports and films

/** The chosen person as a photo that the server has: the sample's is added once. */
async function owned() {
  if (chosen !== SAMPLE) return chosen;
  const known = state.photos.find(photo => photo.title === "sample person"), photo = known || await send("api/sample", { method: "POST" });
  if (!photo) throw new Error("The sample person cannot be added now.");
  if (known) choose(known.id);
  return photo.id;
}
async function made() {
  const id = await owned();
  while (photoOf(id) && !photoOf(id).known) {
    if (photoOf(id).status === "unusable") throw new Error(photoOf(id).problem);
    await new Promise(done => setTimeout(done, 400));
  }
  return id;
}
const exporter = new Exporter({ stage: () => stage, choices: () => choices, performance: performance_, owned, made, motionOf, poll: () => poll() });
byId("export").onclick = () => exporter.open(photoOf(chosen));
const films = new Films(byId("jobs"), () => poll());

// --- what the server says

let timer, asked = 0;  // number of the last request; earlier answers are out of date
async function poll() {
  clearTimeout(timer);
  const own = asked += 1;
  try {
    const found = await ask("api/state");
    if (own !== asked) return;
    state = found;
    answered = true;
    byId("lost").hidden = true;
    showPeople();
    films.show(state.jobs, photoOf);
    motions.show(state.motions);
    byId("films").hidden = !state.jobs.length;
    say(byId("full"), state.problem);
    byId("damaged").hidden = !state.damaged;
    byId("damaged").firstElementChild.textContent = `${state.damaged} photo${state.damaged > 1 ? "s or films" : " or film"} cannot be read.`;
    document.title = films.title || "a2v";
  } catch {
    if (own !== asked) return;
    byId("lost").hidden = false;
  }
  const busy = state.jobs.some(job => ["waiting", "running"].includes(job.status)) || state.photos.some(photo => photo.status === "looking" || photo.status === "ready" && !photo.known);
  clearTimeout(timer);
  timer = setTimeout(poll, busy ? 500 : document.hidden ? 8000 : 2500);
}
byId("damaged").lastElementChild.onclick = () => ask("api/damaged", { method: "DELETE" }).catch(() => {}).then(poll);
document.addEventListener("visibilitychange", () => { if (!document.hidden) poll(); });
window.addEventListener("popstate", () => {
  for (const dialog of document.querySelectorAll("dialog[open]")) dialog.dispatchEvent(new Event("cancel", { cancelable: true })) && dialog.close();
  const id = new URLSearchParams(location.hash.slice(1)).get("photo") || SAMPLE;
  if (id !== chosen) choose(id, "");
});

/** The script of the viewer, after the first paint. */
function loadViewer() {
  return new Promise((done, fail) => { document.head.append(make("script", { src: "page/three.js", onload: done, onerror: () => fail(new Error("the viewer cannot be loaded")) })); });
}

async function begin() {
  poll();
  try { choices = await ask("api/choices"); } catch { setTimeout(begin, 2000); return; }
  byId("theme").append(...[...new Set(choices.actions.map(entry => entry.theme))].sort().map(name => new Option(name)));
  gallery.show(choices.actions, "");
  document.body.dataset.ready = "yes";
  loadFigures().then(() => gallery.tick());
}
loadViewer().then(() => {
  stage = new Stage(byId("stage"), showPlay);
  stage.look = byId("light").value;
  showPlay();
  drawn = "";
  showPeople();
}).catch(error => say(byId("problem"), `This browser cannot show the stage: ${error.message}. Films and files can be made all the same.`));
showPeople();
begin();
