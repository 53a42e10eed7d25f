// The page shows the state of the server, which it requests repeatedly; text from outside never becomes markup.
import { Camera } from "./camera.js";
import { Clip } from "./clip.js";
import { Corrector } from "./correct.js";
import { Gallery, loadFigures } from "./gallery.js";
import { Ground } from "./ground.js";
import { JobCard } from "./job.js";
import { ask, byId, make, say, size } from "./tools.js";

const BONES = [
  [11, 12], [11, 23], [12, 24], [23, 24], [11, 13], [13, 15], [12, 14], [14, 16], [23, 25], [25, 27], [24, 26], [26, 28],
  [27, 29], [29, 31], [27, 31], [28, 30], [30, 32], [28, 32], [15, 17], [15, 19], [15, 21], [16, 18], [16, 20], [16, 22],
];
const FIRST_ACTION = "Walk";  // chosen with the first photo, so that one more click makes a video
let choices = null, state = { photos: [], jobs: [] };
let chosen = new URLSearchParams(location.hash.slice(1)).get("photo");
const cards = new Map();

// --- the photo

const photoOf = id => state.photos.find(photo => photo.id === id);
const choose = id => {
  chosen = id;
  history.replaceState(null, "", id ? `#photo=${id}` : location.pathname);
  showPhotos();
};

async function upload(blob, name) {
  if (!blob) return;
  if (choices && blob.size > choices.upload) return say(byId("photo-problem"), `This is larger than ${choices.upload >> 20} MB; send a smaller photo.`);
  await send(`api/photos?name=${encodeURIComponent(name || "photo")}`, { method: "POST", body: blob });
}

async function send(address, how) {
  const problem = byId("photo-problem");
  say(problem, "");
  say(byId("forgotten"), "");
  byId("drop").classList.add("busy");
  byId("seen-text").textContent = "";
  try {
    const photo = await ask(address, how);
    asked += 1;  // an answer under way does not know this photo
    state.photos.push(photo);
    choose(photo.id);
    if (!action.value.trim()) { action.value = FIRST_ACTION; read(); }
    poll();
  } catch (error) { say(problem, error.message); }
  byId("drop").classList.remove("busy");
}

let drawn = "";
function showPhotos() {
  const now = JSON.stringify([chosen, state.photos]);
  if (now === drawn) return;
  drawn = now;
  if (!photoOf(chosen)) chosen = state.photos.length ? state.photos[state.photos.length - 1].id : null;
  byId("photos").replaceChildren(...[...state.photos].reverse().map(photo => {
    const button = make("button", { type: "button", title: photo.title });
    button.setAttribute("aria-pressed", photo.id === chosen);
    button.setAttribute("aria-label", `photo ${photo.title}`);
    button.append(photo.width ? make("img", { src: `photos/${photo.id}/photo.jpg`, alt: "" }) : "…");
    button.onclick = () => choose(photo.id);
    return button;
  }));
  byId("photos").hidden = state.photos.length < 2;
  const photo = photoOf(chosen);
  byId("chosen").hidden = !photo;
  byId("drop").classList.toggle("small", Boolean(photo));
  if (photo) showPhoto(photo);
}

function showPhoto(photo) {
  const seen = photo.status === "ready", shown = byId("shown"), mask = byId("mask"), bones = byId("bones");
  const address = photo.width ? `photos/${photo.id}/photo.jpg` : "";
  if (shown.getAttribute("src") !== address) address ? shown.setAttribute("src", address) : shown.removeAttribute("src");
  shown.alt = photo.title;
  const look = `photos/${photo.id}/mask.png?${photo.looks}`;
  if (seen && mask.getAttribute("src") !== look) mask.src = look;
  mask.hidden = !seen || !byId("show-mask").checked;
  bones.toggleAttribute("hidden", !seen || !byId("show-bones").checked);  // an SVG has no property of that name
  if (seen) drawBones(bones, photo);
  byId("correct").hidden = !seen;
  byId("further").hidden = !seen;
  byId("more-photos").replaceChildren(...photo.more.map((digest, index) => make("img", { src: `photos/${photo.id}/more-${index + 1}.jpg?${digest}`, alt: `further photo ${index + 1}` })));
  byId("less").hidden = !photo.more.length;
  clip.show(photo);
  byId("look-again").hidden = photo.status !== "unusable";
  document.querySelectorAll("#layers-row .check").forEach(label => { label.hidden = !seen; });
  const sure = photo.landmarks.filter(point => point[2] > 0.5).length;
  byId("seen-text").textContent =
    photo.status === "looking" ? "Looking for the person…" :
    seen ? `Found the person: ${sure} of ${photo.landmarks.length} landmarks are clear.${photo.corrected ? " Corrected by you." : ""}${photo.known ? " This character is kept from an earlier video." : ""}` : "";
  byId("warnings").replaceChildren(...photo.warnings.map(text => make("li", {}, text)));
  say(byId("photo-problem"), photo.status === "unusable" ? photo.problem : "");
}

function drawBones(svg, photo) {
  const space = "http://www.w3.org/2000/svg", unit = Math.max(photo.width, photo.height) / 300;
  svg.setAttribute("viewBox", `0 0 ${photo.width} ${photo.height}`);
  svg.style.setProperty("--bone", 1.5 * unit);
  const parts = [], clear = index => photo.landmarks[index][2] > 0.3;
  const add = (name, values) => {
    const item = document.createElementNS(space, name);
    for (const [key, value] of Object.entries(values)) item.setAttribute(key, value);
    parts.push(item);
  };
  for (const [a, b] of BONES) {
    if (!clear(a) || !clear(b)) continue;
    const [[x1, y1], [x2, y2]] = [photo.landmarks[a], photo.landmarks[b]];
    add("line", { x1, y1, x2, y2 });
  }
  photo.landmarks.forEach(([cx, cy], index) => { if (clear(index)) add("circle", { cx, cy, r: 1.7 * unit, "stroke-width": 0.8 * unit }); });
  svg.replaceChildren(...parts);
}

const drop = byId("drop"), file = byId("file");
file.onchange = () => { upload(file.files[0], file.files[0] && file.files[0].name); file.value = ""; };
for (const name of ["dragover", "drop", "dragleave"]) {
  document.addEventListener(name, event => {
    event.preventDefault();
    drop.classList.toggle("over", name === "dragover");
    const dropped = name === "drop" && event.dataTransfer.files[0];
    if (dropped) upload(dropped, dropped.name);
  });
}
document.addEventListener("paste", event => {
  const pasted = [...event.clipboardData.files].find(item => item.type.startsWith("image/"));
  if (pasted) upload(pasted, pasted.name);
});
byId("show-mask").onchange = byId("show-bones").onchange = () => { const photo = photoOf(chosen); if (photo) showPhoto(photo); };
byId("forget").onclick = async () => {
  const videos = state.jobs.filter(job => job.photo === chosen).length;
  const what = videos ? `this photo, its ${videos} video${videos > 1 ? "s" : ""}` : "this photo";
  if (!confirm(`Delete ${what} and all kept results of this person? Downloaded files are not deleted.`)) return;
  byId("forget").disabled = true;
  try {
    const gone = await ask(`api/photos/${chosen}`, { method: "DELETE" });
    const results = gone.calls ? `, ${gone.calls} kept results (${size(gone.bytes)})` : "";
    say(byId("forgotten"), `Deleted: the photo${videos ? `, ${videos} video${videos > 1 ? "s" : ""}` : ""}${results}. Downloaded files are not deleted.`);
    choose(null);
  } catch (error) { say(byId("photo-problem"), error.message); }
  byId("forget").disabled = false;
  poll();
};
byId("look-again").onclick = async () => {
  await ask(`api/photos/${chosen}/again`, { method: "POST" }).catch(error => say(byId("photo-problem"), error.message));
  poll();
};
byId("sample").onclick = () => send("api/sample", { method: "POST" });
const corrector = new Corrector(() => poll());
byId("correct").onclick = () => corrector.open(photoOf(chosen), choices.limbs);
byId("more-file").onchange = async () => {
  const added = byId("more-file").files[0], problem = byId("photo-problem");
  byId("more-file").value = "";
  if (!added) return;
  say(problem, added.size > choices.upload ? `This is larger than ${choices.upload >> 20} MB; send a smaller photo.` : "");
  if (added.size <= choices.upload) await ask(`api/photos/${chosen}/more`, { method: "POST", body: added }).catch(error => say(problem, error.message));
  poll();
};
byId("less").onclick = () => ask(`api/photos/${chosen}/more`, { method: "DELETE" }).catch(error => say(byId("photo-problem"), error.message)).then(poll);
const clip = new Clip(() => photoOf(chosen), () => choices, () => poll());
const ground = new Ground();
new Camera(byId("camera"), blob => upload(blob, "camera"));

// --- the action

const action = byId("action"), model = byId("model"), understood = byId("understood");
const modelNow = () => choices && choices.models.find(item => item.name === model.value);

function showActions() {
  const now = modelNow();
  if (!now) return;
  const wanted = byId("filter").value.trim().toLowerCase();
  const names = now.actions.filter(name => name.toLowerCase().includes(wanted));
  byId("count").textContent = `${now.actions.length} actions${now.name === choices.models[0].name ? "" : ` of ${now.name}`}`;
  gallery.show(now.name, names);
}
const gallery = new Gallery(byId("actions"), name => {
  action.value = action.value.trim() ? `${action.value.trim()}, ${name}` : name;
  read();
});

/** What was understood, a chip a part: pressed, it offers what else may have been meant. */
function showParts(parts) {
  const change = (part, name) => {
    const found = action.value.toLowerCase().indexOf(part.text.toLowerCase());
    action.value = found < 0 ? parts.map(one => one === part ? name : one.action).filter(Boolean).join(", ")
      : action.value.slice(0, found) + name + action.value.slice(found + part.text.length);
    action.value = action.value.replace(/^[\s,]+|[\s,]+$/g, "").replace(/,(\s*,)+/g, ",");
    read();
    action.focus();
  };
  const chips = parts.flatMap((part, index) => {
    const chip = make("button", { type: "button", className: "chip" }, part.action), others = make("span", { className: "others", hidden: true });
    chip.setAttribute("aria-expanded", "false");
    chip.title = part.seconds ? `${part.seconds} s; press to change it` : "press to change it";
    others.append(...part.near.map(name => make("button", { type: "button", className: "chip quiet", onclick: () => change(part, name) }, name)));
    others.append(make("button", { type: "button", className: "chip quiet", onclick: () => change(part, "") }, "leave out"));
    chip.onclick = () => { others.hidden = !others.hidden; chip.setAttribute("aria-expanded", !others.hidden); };
    return [index ? " → " : "", chip, others];
  });
  understood.replaceChildren("Understood: ", ...chips);
}

let reading = 0;
async function read() {
  const turn = ++reading, text = action.value.trim();
  understood.className = "understood";
  if (!text) { understood.textContent = ""; return; }
  try {
    const found = await ask("api/words", { method: "POST", body: JSON.stringify({ model: model.value, text }) });
    if (turn !== reading) return;
    understood.classList.add("good");
    showParts(found.parts);
  } catch (error) {
    if (turn !== reading) return;
    understood.classList.add("bad");
    understood.textContent = error.message;
  }
}
let typing;
action.oninput = () => { clearTimeout(typing); typing = setTimeout(read, 250); };
model.onchange = () => { showActions(); read(); };
byId("filter").oninput = showActions;
byId("filter").onkeydown = event => { if (event.key === "Enter") event.preventDefault(); };

// --- the video

byId("background").onchange = () => { byId("color-label").hidden = byId("background").value !== "color"; };
byId("maker").onsubmit = async event => {
  event.preventDefault();
  const problem = byId("make-problem"), photo = photoOf(chosen), number = name => Number(byId(name).value);
  say(problem, "");
  if (!photo) { say(problem, "Choose a photo first."); file.focus(); return; }
  if (!action.value.trim() && !clip.used) { say(problem, "Choose an action or describe one first."); action.focus(); return; }
  const views = [...document.querySelectorAll("#views input:checked")].map(box => box.value);
  const background = byId("background").value;
  const wish = {
    action: clip.used ? photo.clip_title : action.value.trim(), clip: clip.used, model: model.value, seconds: number("seconds"), fps: number("fps"), seed: number("seed"),
    views, size: number("size"), spp: number("spp"), background: background === "color" ? byId("color").value : background,
    look: byId("look").value, aspect: byId("aspect").value, camera: byId("view-camera").value, path: clip.used ? "" : ground.value,
  };
  byId("make").disabled = true;
  try {
    const job = await ask("api/jobs", { method: "POST", body: JSON.stringify({ photo: photo.id, wish }) });
    await poll();
    const card = cards.get(job.id);
    if (card) card.element.scrollIntoView({ block: "nearest" });
  } catch (error) { say(problem, error.message); }
  byId("make").disabled = false;
};

function showJobs() {
  const ids = new Set(state.jobs.map(job => job.id));
  for (const [id, card] of cards) if (!ids.has(id)) { card.element.remove(); cards.delete(id); }
  for (const job of state.jobs) {
    if (!cards.has(job.id)) {
      const card = new JobCard(job, poll);
      cards.set(job.id, card);
      byId("jobs").prepend(card.element);
    }
    const alike = state.jobs.filter(one => one.id !== job.id && one.status === "done" && one.photo === job.photo && one.wish.action === job.wish.action && one.wish.seed !== job.wish.seed);
    cards.get(job.id).show(job, photoOf(job.photo), alike, choices);
  }
  byId("empty").hidden = state.jobs.length > 0;
  gallery.resting = state.jobs.some(job => job.status === "running");
  const running = state.jobs.find(job => job.progress);
  document.title = running ? `${Math.floor(100 * (running.progress.share || 0))} % – a2v` : "a2v";
}

// --- what the server says

let timer;
let asked = 0;  // number of the last request; earlier answers are out of date
async function poll() {
  clearTimeout(timer);
  const own = asked += 1;
  try {
    const found = await ask("api/state");
    if (own !== asked) return;
    state = found;
    byId("lost").hidden = true;
    showPhotos();
    showJobs();
    say(byId("full"), state.problem);
    byId("damaged").hidden = !state.damaged;
    byId("damaged").firstElementChild.textContent = `${state.damaged} photo${state.damaged > 1 ? "s or videos" : " or video"} cannot be read.`;
  } catch (error) {
    if (own !== asked) return;
    byId("lost").hidden = false;
  }
  const busy = state.jobs.some(job => ["waiting", "running"].includes(job.status)) || state.photos.some(photo => photo.status === "looking");
  clearTimeout(timer);
  timer = setTimeout(poll, busy ? 500 : document.hidden ? 8000 : 2500);
}
byId("damaged").lastElementChild.onclick = () => ask("api/damaged", { method: "DELETE" }).catch(() => {}).then(poll);
document.addEventListener("visibilitychange", () => { if (!document.hidden) poll(); });

async function begin() {
  poll();
  try { choices = await ask("api/choices"); } catch { setTimeout(begin, 2000); return; }
  model.replaceChildren(...choices.models.map(item => new Option(`${item.name} (${item.actions.length} actions)`, item.name)));
  byId("views").replaceChildren(...choices.views.map(name => {
    const label = make("label", { className: "check" });
    label.append(make("input", { type: "checkbox", value: name, checked: name !== "turntable" }), ` ${name}`);
    return label;
  }));
  showActions();
  read();
  document.body.dataset.ready = "yes";
  loadFigures().then(() => gallery.tick());
}
begin();
