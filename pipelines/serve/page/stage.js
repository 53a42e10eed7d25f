// The stage: light, ground, a camera that is turned by hand, and one person who waits, acts, speaks or follows a camera. Needs three.js as `THREE`.
import { Actor } from "./actor.js";
import { Pace } from "./pace.js";

const APART = 1.15;  // meters between the takes of a row
const SHADED = 4.5;  // meters around the middle where the ground takes shadows
const SETTLED = 2000;  // milliseconds after a change until the camera has come to rest
const STEADY = 6;  // pixels that a press may move
const FAR = 16;  // meters from the middle after which everything is moved back, by whole squares of the ground
const HOME = { azimuth: 22, elevation: 7, distance: 4.9 };
const still = matchMedia("(prefers-reduced-motion: reduce)"), night = matchMedia("(prefers-color-scheme: dark)");

export class Stage {
  /** `changed` hears that something was done that the page shows: playing or not. */
  constructor(element, changed) {
    this.element = element;
    this.changed = changed;
    this.view = { ...HOME };
    this.close = false;
    this.facing = 0;
    this.running = !still.matches;
    this.actor = null;
    this.row = [];  // further takes of the same person, beside the first
    this.begin();
    this.watch();
    new ResizeObserver(() => this.resize()).observe(element);
    element.replaceChildren(this.renderer.domElement);
    this.resize();
    this.pace = new Pace(this);
    this.last = performance.now();
    const tick = now => { this.draw(now); requestAnimationFrame(tick); };
    requestAnimationFrame(tick);
  }

  begin() {
    this.weak = drawnByProcessor();
    const renderer = this.renderer = new THREE.WebGLRenderer({ antialias: !this.weak });
    renderer.outputEncoding = THREE.sRGBEncoding;
    renderer.toneMapping = THREE.ACESFilmicToneMapping;
    renderer.toneMappingExposure = 1.05;
    renderer.shadowMap.enabled = !this.weak;
    renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    renderer.localClippingEnabled = true;
    renderer.domElement.setAttribute("aria-hidden", "true");
    const scene = this.scene = new THREE.Scene();
    scene.background = new THREE.Color();
    scene.fog = new THREE.Fog(0, 9, 26);
    scene.add(this.sky = new THREE.HemisphereLight(0xffffff, 0xb9b4ac, this.weak ? 0.9 : 0.35));
    const sun = this.sun = new THREE.DirectionalLight(0xfff1e0, 1.5), rim = this.rim = new THREE.DirectionalLight(0xcfe0ff, 0.55);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    Object.assign(sun.shadow.camera, { left: -1.8, right: 1.8, top: 1.8, bottom: -1.8, near: 0.5, far: 12 });
    sun.shadow.bias = -0.0005;
    sun.shadow.normalBias = 0.02;
    sun.shadow.radius = 5;
    scene.add(sun, sun.target, rim, rim.target);
    if (!this.weak) {  // soft light from a bright room around the stage
      const room = new THREE.Scene(), lamp = (color, x, y, z, w, h) => {
        const panel = new THREE.Mesh(new THREE.PlaneGeometry(w, h), new THREE.MeshBasicMaterial({ color, side: THREE.DoubleSide }));
        panel.position.set(x, y, z);
        panel.lookAt(0, 1, 0);
        room.add(panel);
      };
      room.background = new THREE.Color(0x8a8f96);
      lamp(0xffffff, 0, 5, 0, 6, 6);
      lamp(0xfff4e6, 5, 2, 3, 3, 4);
      lamp(0xdfe9ff, -5, 2, -2, 3, 4);
      const maker = new THREE.PMREMGenerator(renderer);
      scene.environment = maker.fromScene(room, 0.04).texture;
    }
    const floor = this.floor = new THREE.Mesh(new THREE.PlaneGeometry(2 * SHADED, 2 * SHADED), new THREE.ShadowMaterial({ opacity: 0.3 }));
    floor.rotation.x = -Math.PI / 2;
    floor.receiveShadow = true;
    floor.visible = !this.weak;
    floor.material.depthWrite = false;
    this.spot = new THREE.MeshBasicMaterial({ map: blot(), transparent: true, opacity: 0.4, depthWrite: false });
    this.light = new THREE.GridHelper(80, 80, 0x8a949d, 0xa9b2ba);
    this.dark = new THREE.GridHelper(80, 80, 0x46505a, 0x343d46);
    this.light.position.y = this.dark.position.y = -0.002;
    this.way = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0x2f7de1, linewidth: 3 }));
    this.way.position.y = 0.01;
    scene.add(floor, this.light, this.dark, this.way);
    this.camera = new THREE.PerspectiveCamera(28, 1, 0.05, 120);
    this.center = new THREE.Vector3(0, 0.86, 0);
    const dress = () => {
      this.wake();
      scene.background.set(getComputedStyle(this.element).backgroundColor);
      scene.fog.color.copy(scene.background);
      this.dark.visible = night.matches || this.mood === "night";
      this.light.visible = !this.dark.visible;
    };
    night.addEventListener("change", dress);
    this.dress = dress;
    dress();
  }

  /** Light of the stage by the name of a film's light. */
  set look(name) {
    this.mood = name;
    this.element.dataset.look = name;
    const [sky, sun, color, rim] = { outdoor: [0.55, 2.1, 0xffe9c4, 0.3], night: [0.12, 0.5, 0xa9c4ff, 0.9] }[name] || [this.weak ? 0.9 : 0.35, 1.5, 0xfff1e0, 0.55];
    this.sky.intensity = sky;
    this.sun.intensity = sun;
    this.sun.color.set(color);
    this.rim.intensity = rim;
    this.dress();
  }

  resize() {
    const width = Math.max(this.element.clientWidth, 1), height = Math.max(this.element.clientHeight, 1);
    this.renderer.setSize(width, height);
    this.wake();
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  /** The camera by mouse, fingers, wheel and arrow keys; in drawing mode the ground takes a path. */
  watch() {
    const { element, view } = this, fingers = new Map();
    const spread = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };
    element.onpointerdown = event => {
      element.setPointerCapture(event.pointerId);
      if (this.drawing) { this.points = [this.ground(event)]; return; }
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      this.pressed = { x: event.clientX, y: event.clientY };
    };
    element.onclick = event => {
      if (this.choose && this.pressed && Math.hypot(event.clientX - this.pressed.x, event.clientY - this.pressed.y) < STEADY) this.choose(this.takeAt(event));
    };
    element.onpointerup = element.onpointercancel = event => {
      fingers.delete(event.pointerId);
      if (this.points) { const drawn = this.points.filter(Boolean); this.points = null; this.drawing(drawn); }
    };
    element.onpointermove = event => {
      if (this.points) { this.points.push(this.ground(event)); this.showPath(this.points.filter(Boolean), true); return; }
      const last = fingers.get(event.pointerId);
      if (!last) return;
      const before = fingers.size > 1 ? spread() : 0;
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (fingers.size > 1) this.zoom(before / Math.max(spread(), 1));
      else this.turn(-0.4 * (event.clientX - last.x), 0.3 * (event.clientY - last.y));
    };
    element.addEventListener("wheel", event => { event.preventDefault(); this.zoom(Math.exp(event.deltaY * 0.001)); }, { passive: false });
    element.ondblclick = () => this.lookFrom(HOME);
  }

  turn(across, up) {
    this.wake();
    this.view.azimuth += across;
    this.view.elevation = Math.min(Math.max(this.view.elevation + up, -4), 85);
  }

  /** Look from another side. */
  lookFrom(view) { Object.assign(this.view, view); this.wake(); }

  zoom(factor) { this.wake(); this.view.distance = Math.min(Math.max(this.view.distance * factor, 0.8), 20); }

  /** Where a pointer meets the ground, x and z in meters; null above the horizon. */
  ground(event) {
    const box = this.element.getBoundingClientRect(), caster = new THREE.Raycaster();
    caster.setFromCamera({ x: 2 * (event.clientX - box.left) / box.width - 1, y: 1 - 2 * (event.clientY - box.top) / box.height }, this.camera);
    const found = caster.ray.intersectPlane(GROUND(), new THREE.Vector3());
    return found ? [found.x, found.z] : null;
  }

  showPath(points, raw = false) {
    this.wake();
    const [x, z] = raw ? [0, 0] : (this.actor ? this.actor.start : [0, 0]);
    this.way.geometry.dispose();
    this.way.geometry = new THREE.BufferGeometry().setFromPoints(points.map(point => new THREE.Vector3(point[0] + x, 0, point[1] + z)));
  }

  // --- the person

  /** Show a person; the cycle in the file is how the person waits. */
  async show(address, fresh = () => true) {
    const data = await (await fetch(address)).arrayBuffer(), actor = await Actor.of(data);
    if (!fresh()) return false;
    this.alone();
    if (this.actor) this.leave(this.actor);
    this.data = data;
    this.actor = actor;
    this.clearShapes();
    this.enter(actor);
    this.speech = makeSpeech(actor.model, VISEMES);
    actor.act(actor.waiting, true);
    return true;
  }

  /** Bring a person on the stage, with the spot where the feet meet the ground. */
  enter(actor) {
    this.wake();
    actor.contact = new THREE.Mesh(new THREE.PlaneGeometry(0.9, 0.9), this.spot);
    actor.contact.rotation.x = -Math.PI / 2;
    this.scene.add(actor.model, actor.contact);
    if (this.weak) actor.bendHere();
  }

  leave(actor) { this.scene.remove(actor.model, actor.contact); }

  act(clip) { this.alone(); this.actor.act(clip); }

  lengthen(short, whole) { if (this.actor) this.actor.lengthen(short, whole); }

  wait() { this.alone(); if (this.actor) this.actor.act(this.actor.waiting, true); }

  get acting() { return this.actor && this.actor.acting; }
  get waiting() { return this.actor && this.actor.waiting; }
  get place() { return this.actor ? this.actor.pose.place : [0, 0.9, 0]; }
  set live(told) { this.wake(); if (this.actor) this.actor.live = told; }
  drive(told) { if (this.actor) this.actor.drive(told); }

  /** Show several takes beside each other, as the camera sees them; `choose` hears which one is pressed. */
  async compare(clips, choose) {
    const actor = this.actor, more = await Promise.all(clips.slice(1).map(() => Actor.of(this.data)));
    if (actor !== this.actor) return;
    this.alone();
    const a = this.view.azimuth * Math.PI / 180 + actor.heading + actor.turned(actor.acts.at(-1)), middle = (clips.length - 1) / 2;
    [actor, ...more].forEach((one, index) => {
      const off = (index - middle) * APART;
      if (index) this.enter(one);
      one.aside = [off * Math.cos(a), -off * Math.sin(a)];
    });
    more.forEach((one, index) => one.act(clips[index + 1], false, actor, one.aside));
    actor.act(clips[0], false, actor, actor.aside);
    this.row = more;
    this.choose = choose;
  }

  /** Only the first take stays. */
  alone() {
    for (const one of this.row) this.leave(one);
    this.row = [];
    this.choose = null;
  }

  get actors() { return this.actor ? [this.actor, ...this.row] : []; }

  /** Which take a pointer means. */
  takeAt(event) {
    const box = this.element.getBoundingClientRect(), at = 2 * (event.clientX - box.left) / box.width - 1;
    const away = this.actors.map(one => Math.abs(new THREE.Vector3(...one.pose.place).project(this.camera).x - at));
    return away.indexOf(Math.min(...away));
  }

  /** Play or rest. */
  set plays(on) { this.wake(); this.running = on; this.changed(); }

  get plays() { return this.running; }

  shift(x, z) {
    for (const one of this.actors) one.shift(x, z);
    this.center.x += x;
    this.center.z += z;
  }

  /** Speak a line; the browser's voice too, where it has one. */
  say(text) {
    if (!this.speech || !this.speech.able) return;
    const voice = window.speechSynthesis;
    if (voice && voice.getVoices().length) { voice.cancel(); voice.speak(new SpeechSynthesisUtterance(text)); }
    this.speech.say(text, performance.now() / 1000);
    this.speaking = true;
  }

  // --- what is made

  /** Show the photo as a card that stands on the stage, with its outline once it is known. */
  card(photo, mask = "") {
    this.clearShapes();
    if (this.actor) this.actor.model.visible = false;
    Object.assign(this.view, { azimuth: 0, elevation: 4 });
    this.facing = 0;
    const height = 1.9, board = new THREE.Group(), width = height * photo.width / photo.height;
    const layer = (address, z) => {
      const plane = new THREE.Mesh(new THREE.PlaneGeometry(width, height), new THREE.MeshBasicMaterial({ transparent: true, side: THREE.DoubleSide, toneMapped: false }));
      new THREE.TextureLoader().load(address, map => { map.encoding = THREE.sRGBEncoding; plane.material.map = map; plane.material.needsUpdate = true; this.wake(); });
      plane.position.set(0, height / 2, z);
      board.add(plane);
    };
    layer(photo.address, 0);
    if (mask) layer(mask, 0.004);
    board.position.set(this.center.x, 0, this.center.z - (this.shape ? 0.8 : 0));
    this.board = board;
    this.scene.add(board);
  }

  /** Show a finished stage of the person: a shape that rises out of the ground. */
  async form(address) {
    const data = await (await fetch(address)).arrayBuffer(), [count, faces] = new Uint32Array(data, 0, 2);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(data, 8, 3 * count), 3));
    geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(data, 8 + 12 * count, 3 * faces), 1));
    const levels = new Uint8Array(data, 8 + 12 * (count + faces), 3 * count), colors = new Float32Array(levels.length);
    for (let at = 0; at < levels.length; at++) colors[at] = Math.pow(levels[at] / 255, 2.2);
    geometry.setAttribute("color", new THREE.BufferAttribute(colors, 3));
    geometry.computeVertexNormals();
    const edge = new THREE.Plane(new THREE.Vector3(0, -1, 0), 0);
    const shape = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.75, clippingPlanes: [edge] }));
    shape.castShadow = true;
    shape.position.set(this.center.x, 0, this.center.z);
    if (this.actor) this.actor.model.visible = false;
    if (this.board) this.board.position.z = this.center.z - 0.9;
    if (this.older) this.scene.remove(this.older);
    this.older = this.shape;
    this.shape = shape;
    this.rising = { edge, height: 0 };
    this.scene.add(shape);
  }

  clearShapes() {
    this.wake();
    for (const item of [this.board, this.shape, this.older]) if (item) this.scene.remove(item);
    this.board = this.shape = this.older = this.rising = null;
    if (this.actor) this.actor.model.visible = true;
  }

  rise(passed) {
    if (!this.rising) return;
    this.rising.height = still.matches ? 3 : this.rising.height + 2.2 * passed;
    this.rising.edge.constant = this.rising.height;
    if (this.rising.height > 2.4) { if (this.older) this.scene.remove(this.older); this.older = this.rising = null; this.shape.material.clippingPlanes = []; }
  }

  // --- drawing

  /** Draw for a while: something has changed. */
  wake() { this.until = performance.now() + SETTLED; }

  /** Whether anything on the stage moves. */
  get moves() { return Boolean(this.rising || this.actor && this.actor.model.visible && (this.running || this.actor.live || this.speaking)); }

  draw(now) {
    if (document.hidden || !this.moves && now > this.until || !this.pace.due(now)) return;
    const passed = Math.min((now - this.last) / 1000, 0.1), { view, center, camera, actor } = this;
    this.last = now;
    this.rise(passed);
    for (const one of this.actors) { one.move(passed, this.running); one.contact.position.set(one.pose.place[0], 0.002, one.pose.place[2]); }
    const [x, , z] = this.place;
    if (Math.hypot(x, z) > FAR && !actor.live) this.shift(-Math.round(x), -Math.round(z));
    this.speaking = Boolean(actor && this.speech.show(now / 1000));
    for (const one of this.actors) one.bend();
    const share = 1 - Math.exp(-4 * passed), all = this.actors, middle = axis => all.length ? all.reduce((sum, one) => sum + one.pose.place[axis], 0) / all.length : 0;
    center.x += (middle(0) - center.x) * share;
    center.z += (middle(2) - center.z) * share;
    const heading = actor ? actor.heading : 0, off = Math.atan2(Math.sin(heading - this.facing), Math.cos(heading - this.facing));
    this.facing += off * (1 - Math.exp(-3 * passed));  // the camera goes round to where the person began to face
    const far = 1 + 0.28 * this.row.length, reach = this.row.length ? 3.4 : 1.8, shade = this.sun.shadow.camera;
    if (shade.right !== reach) { Object.assign(shade, { left: -reach, right: reach }); shade.updateProjectionMatrix(); }
    this.spread = (this.spread || 1) + (far - (this.spread || 1)) * share;
    const a = view.azimuth * Math.PI / 180 + this.facing, e = view.elevation * Math.PI / 180, wide = Math.max(1, 0.62 / camera.aspect);
    const head = this.close && actor && actor.skull ? actor.skull.getWorldPosition(new THREE.Vector3()) : null, aim = head || center;
    camera.position.set(Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e)).multiplyScalar(view.distance * wide * (head ? 0.24 : this.spread)).add(aim);
    camera.position.y = Math.max(camera.position.y, 0.05);
    camera.lookAt(aim);
    const low = Math.min(0.09, 46 / this.element.clientHeight);  // the controls cover the lower edge
    camera.setViewOffset(this.element.clientWidth, this.element.clientHeight, 0, low * this.element.clientHeight * 0.6, this.element.clientWidth, this.element.clientHeight);
    this.floor.position.set(center.x, 0, center.z);
    this.sun.target.position.set(center.x, 0.9, center.z);
    this.sun.position.set(center.x + 1.9, 4.9, center.z + 2.8);
    this.rim.target.position.copy(this.sun.target.position);
    this.rim.position.set(center.x - 2.5, 3, center.z - 3.2);
    this.renderer.render(this.scene, camera);
    this.frames = (this.frames || 0) + 1;
    this.element.dataset.frames = this.frames;
  }
}

/** The ground as a plane; three.js is there only once the page has loaded it. */
const GROUND = () => new THREE.Plane(new THREE.Vector3(0, 1, 0), 0);

/** Whether the browser draws without a graphics card. */
function drawnByProcessor() {
  const context = document.createElement("canvas").getContext("webgl"), told = context && context.getExtension("WEBGL_debug_renderer_info");
  const name = told ? context.getParameter(told.UNMASKED_RENDERER_WEBGL) : "";
  if (context && context.getExtension("WEBGL_lose_context")) context.getExtension("WEBGL_lose_context").loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

/** A soft dark spot: where the feet meet the ground. */
function blot() {
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
  canvas.width = canvas.height = 128;
  const fill = pen.createRadialGradient(64, 64, 4, 64, 64, 62);
  fill.addColorStop(0, "rgba(0,0,0,.55)");
  fill.addColorStop(1, "rgba(0,0,0,0)");
  pen.fillStyle = fill;
  pen.fillRect(0, 0, 128, 128);
  return new THREE.CanvasTexture(canvas);
}

