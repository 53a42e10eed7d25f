// The stage: light, ground, a camera that is turned by hand, and one person who waits, acts, speaks or follows a camera. Needs three.js as `THREE`.
const BLEND = 0.35;  // seconds from one motion to the next
const FOLLOW = 18;  // share per second of the way to the newest pose of the live camera
const FAR = 16;  // meters from the middle after which everything is moved back, by whole squares of the ground
const HOME = { azimuth: 22, elevation: 7, distance: 4.9 };
const still = matchMedia("(prefers-reduced-motion: reduce)"), night = matchMedia("(prefers-color-scheme: dark)");

/** Where the numbers of a clip lead: bones' quaternions, the first bone's place, and the face. */
function sampled(clip, time, out) {
  const moment = Math.min(Math.max(time, 0) * clip.fps, clip.frames - 1), first = Math.floor(moment), next = Math.min(first + 1, clip.frames - 1), part = moment - first;
  const width = out.quats.length, { bones, place } = clip;
  for (let at = 0; at < width; at += 4) {
    const a = first * width + at, b = next * width + at;
    const sign = bones[a] * bones[b] + bones[a + 1] * bones[b + 1] + bones[a + 2] * bones[b + 2] + bones[a + 3] * bones[b + 3] < 0 ? -part : part;
    let length = 0;
    for (let axis = 0; axis < 4; axis++) { const value = bones[a + axis] * (1 - part) + bones[b + axis] * sign; out.quats[at + axis] = value; length += value * value; }
    length = Math.sqrt(length) || 1;
    for (let axis = 0; axis < 4; axis++) out.quats[at + axis] /= length;
  }
  for (let axis = 0; axis < 3; axis++) out.place[axis] = place[3 * first + axis] * (1 - part) + place[3 * next + axis] * part;
  out.face = {};
  for (const [name, row] of Object.entries(clip.face || {})) out.face[name] = row[first] * (1 - part) + row[next] * part;
}

/** A motion as the server sends it, with numbers that can be sampled. */
export function unpacked(told) {
  const text = atob(told.bones), bytes = new Uint8Array(text.length);
  for (let at = 0; at < bytes.length; at++) bytes[at] = text.charCodeAt(at);
  const whole = new Int16Array(bytes.buffer), bones = new Float32Array(whole.length);
  for (let at = 0; at < bones.length; at++) bones[at] = whole[at] / 32767;
  return { fps: told.fps, frames: told.frames, bones, place: Float32Array.from(told.place), face: told.face };
}

export class Stage {
  /** `changed` hears that something was done that the page shows: playing or not. */
  constructor(element, changed) {
    this.element = element;
    this.changed = changed;
    this.view = { ...HOME };
    this.close = false;
    this.facing = 0;
    this.running = !still.matches;
    this.pose = { quats: new Float32Array(0), place: [0, 0.9, 0], face: {} };
    this.acts = [];
    this.begin();
    this.watch();
    new ResizeObserver(() => this.resize()).observe(element);
    element.replaceChildren(this.renderer.domElement);
    this.resize();
    this.last = performance.now();
    const tick = now => { this.draw(now); requestAnimationFrame(tick); };
    requestAnimationFrame(tick);
  }

  begin() {
    this.weak = drawnByProcessor();
    const renderer = this.renderer = new THREE.WebGLRenderer({ antialias: !this.weak, preserveDrawingBuffer: true });
    renderer.outputEncoding = THREE.sRGBEncoding;
    renderer.toneMapping = THREE.ACESFilmicToneMapping;
    renderer.toneMappingExposure = 1.05;
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    renderer.localClippingEnabled = true;
    renderer.setPixelRatio(this.weak ? 0.75 : Math.min(devicePixelRatio, 2));
    renderer.domElement.setAttribute("aria-hidden", "true");
    const scene = this.scene = new THREE.Scene();
    scene.background = new THREE.Color();
    scene.fog = new THREE.Fog(0, 9, 26);
    scene.add(this.sky = new THREE.HemisphereLight(0xffffff, 0xb9b4ac, this.weak ? 0.9 : 0.35));
    const sun = this.sun = new THREE.DirectionalLight(0xfff1e0, 1.5), rim = this.rim = new THREE.DirectionalLight(0xcfe0ff, 0.55);
    sun.castShadow = true;
    sun.shadow.mapSize.set(this.weak ? 512 : 2048, this.weak ? 512 : 2048);
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
    const floor = this.floor = new THREE.Mesh(new THREE.PlaneGeometry(120, 120), new THREE.ShadowMaterial({ opacity: 0.3 }));
    floor.rotation.x = -Math.PI / 2;
    floor.receiveShadow = true;
    floor.material.depthWrite = false;
    this.contact = new THREE.Mesh(new THREE.PlaneGeometry(0.9, 0.9), new THREE.MeshBasicMaterial({ map: blot(), transparent: true, opacity: 0.4, depthWrite: false }));
    this.contact.rotation.x = -Math.PI / 2;
    this.contact.position.y = 0.002;
    this.light = new THREE.GridHelper(80, 80, 0x8a949d, 0xa9b2ba);
    this.dark = new THREE.GridHelper(80, 80, 0x46505a, 0x343d46);
    this.light.position.y = this.dark.position.y = -0.002;
    this.way = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0x2f7de1, linewidth: 3 }));
    this.way.position.y = 0.01;
    scene.add(floor, this.contact, this.light, this.dark, this.way);
    this.camera = new THREE.PerspectiveCamera(28, 1, 0.05, 120);
    this.center = new THREE.Vector3(0, 0.86, 0);
    const dress = () => {
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
    element.ondblclick = () => Object.assign(view, HOME);
  }

  turn(across, up) {
    this.view.azimuth += across;
    this.view.elevation = Math.min(Math.max(this.view.elevation + up, -4), 85);
  }

  zoom(factor) { this.view.distance = Math.min(Math.max(this.view.distance * factor, 0.8), 20); }

  /** Where a pointer meets the ground, x and z in meters; null above the horizon. */
  ground(event) {
    const box = this.element.getBoundingClientRect(), ray = new THREE.Raycaster();
    ray.setFromCamera({ x: 2 * (event.clientX - box.left) / box.width - 1, y: 1 - 2 * (event.clientY - box.top) / box.height }, this.camera);
    const found = ray.intersectObject(this.floor)[0];
    return found ? [found.point.x, found.point.z] : null;
  }

  showPath(points, raw = false) {
    const [x, z] = raw ? [0, 0] : this.start || [0, 0];
    this.way.geometry.dispose();
    this.way.geometry = new THREE.BufferGeometry().setFromPoints(points.map(point => new THREE.Vector3(point[0] + x, 0, point[1] + z)));
  }

  // --- the person

  /** Show a person; the cycle in the file is how the person waits. */
  async show(address, fresh = () => true) {
    const data = await (await fetch(address)).arrayBuffer();
    const gltf = await new Promise((done, fail) => new THREE.GLTFLoader().parse(data, "", done, fail));
    if (!fresh()) return false;
    const bones = [];
    for (const [object, from] of gltf.parser.associations) if (object.isBone && from.nodes !== undefined) bones[from.nodes] = object;
    const model = gltf.scene;
    this.meshes = [];
    model.traverse(node => {
      if (!node.isMesh) return;
      node.castShadow = node.receiveShadow = true;
      node.frustumCulled = false;
      if (node.morphTargetDictionary) this.meshes.push(node);
    });
    if (this.model) this.scene.remove(this.model);
    this.clearShapes();
    this.scene.add(model);
    Object.assign(this, { model, bones, live: null });
    this.pose.quats = new Float32Array(4 * bones.length);
    this.waiting = cycleOf(gltf, model, bones);
    this.skull = bones.find(bone => bone && /head$/i.test(bone.name)) || null;
    this.speech = makeSpeech(model, VISEMES);
    this.acts = [];
    this.act(this.waiting, true);
    return true;
  }

  /** Let the person do a clip again and again, from where the person stands. */
  act(clip, cycle = false) {
    const act = { clip, cycle, time: 0, x: 0, z: 0, heading: 0, since: this.acts.length ? 0 : BLEND, first: clip.bones.slice(0, 4), from: [clip.place[0], clip.place[2]] };
    if (this.acts.length) {
      const now = this.acts[this.acts.length - 1];
      [act.x, act.z] = [this.pose.place[0], this.pose.place[2]];
      act.heading = now.heading + this.turned(now);
    }
    this.start = [act.x, act.z];
    this.acts = [...this.acts.slice(-1), act];
    this.live = null;
  }

  wait() { if (this.waiting) this.act(this.waiting, true); }

  get acting() { const last = this.acts[this.acts.length - 1]; return last ? last.clip : null; }

  /** Play or rest. */
  set plays(on) { this.running = on; this.changed(); }

  get plays() { return this.running; }

  /** How far an act has turned the person since its beginning, radians. */
  turned(act) {
    const moment = { quats: new Float32Array(4), place: [0, 0, 0], face: {} }, clip = act.clip;
    const frame = Math.min(Math.floor(act.time * clip.fps), clip.frames - 1), stride = this.pose.quats.length;
    moment.quats.set(clip.bones.subarray(frame * stride, frame * stride + 4));
    const now = new THREE.Quaternion().fromArray(moment.quats), then = new THREE.Quaternion().fromArray(act.first).invert();
    now.multiply(then);
    return 2 * Math.atan2(now.y, now.w);
  }

  /** The pose of an act in the world. */
  posed(act, out) {
    sampled(act.clip, act.time, out);
    const c = Math.cos(act.heading), s = Math.sin(act.heading), x = out.place[0] - act.from[0], z = out.place[2] - act.from[1];
    out.place[0] = act.x + c * x + s * z;
    out.place[2] = act.z - s * x + c * z;
    const turn = new THREE.Quaternion().setFromAxisAngle(UP, act.heading), root = new THREE.Quaternion().fromArray(out.quats);
    turn.multiply(root).toArray(out.quats);
  }

  step(passed) {
    const count = this.pose.quats.length;
    if (!count || !this.acts.length) return;
    for (const act of this.acts) { act.time += passed; act.since += passed; }
    let now = this.acts[this.acts.length - 1];
    const length = (now.clip.frames - 1) / now.clip.fps;
    if (now.time >= length) {
      if (now.cycle) now.time %= Math.max(length, 1e-3);
      else { this.posed({ ...now, time: length }, this.pose); now.time = length; this.act(now.clip); now = this.acts[this.acts.length - 1]; }
    }
    this.posed(now, this.pose);
    const share = Math.min(1, now.since / BLEND), before = this.acts.length > 1 ? this.acts[0] : null;
    if (before && share < 1) {
      const other = this.other && this.other.quats.length === count ? this.other : this.other = { quats: new Float32Array(count), place: [0, 0, 0], face: {} };
      const end = (before.clip.frames - 1) / before.clip.fps;
      before.time = before.cycle ? before.time % Math.max(end, 1e-3) : Math.min(before.time, end);
      this.posed(before, other);
      const soft = share * share * (3 - 2 * share);
      for (let at = 0; at < count; at += 4) THREE.Quaternion.slerpFlat(this.pose.quats, at, other.quats, at, this.pose.quats, at, soft);
      for (let axis = 0; axis < 3; axis++) this.pose.place[axis] = other.place[axis] * (1 - soft) + this.pose.place[axis] * soft;
    } else if (before) this.acts = [now];
    const [x, z] = [this.pose.place[0], this.pose.place[2]];
    if (Math.hypot(x, z) > FAR) this.shift(-Math.round(x), -Math.round(z));
  }

  shift(x, z) {
    for (const act of this.acts) { act.x += x; act.z += z; }
    this.pose.place[0] += x;
    this.pose.place[2] += z;
    this.center.x += x;
    this.center.z += z;
    if (this.start) this.start = [this.start[0] + x, this.start[1] + z];
  }

  /** The newest pose of the live camera. */
  drive(told) {
    if (told.bones.length === this.pose.quats.length && told.bones.every(Number.isFinite)) this.live = told;
  }

  follow(passed) {
    const share = 1 - Math.exp(-FOLLOW * passed), { quats, place } = this.pose;
    for (let at = 0; at < quats.length; at += 4) THREE.Quaternion.slerpFlat(quats, at, quats, at, this.live.bones, at, share);
    for (let axis = 0; axis < 3; axis++) place[axis] += (this.live.place[axis] - place[axis]) * share;
  }

  /** Speak a line; the browser's voice too, where it has one. */
  say(text) {
    if (!this.speech || !this.speech.able) return;
    const voice = window.speechSynthesis;
    if (voice && voice.getVoices().length) { voice.cancel(); voice.speak(new SpeechSynthesisUtterance(text)); }
    this.speech.say(text, performance.now() / 1000);
  }

  // --- what is made

  /** Show the photo as a card that stands on the stage, with its outline once it is known. */
  card(photo, mask = "") {
    this.clearShapes();
    if (this.model) this.model.visible = false;
    Object.assign(this.view, { azimuth: 0, elevation: 4 });
    this.facing = 0;
    const height = 1.9, board = new THREE.Group(), width = height * photo.width / photo.height;
    const layer = (address, z) => {
      const plane = new THREE.Mesh(new THREE.PlaneGeometry(width, height), new THREE.MeshBasicMaterial({ transparent: true, side: THREE.DoubleSide, toneMapped: false }));
      new THREE.TextureLoader().load(address, map => { map.encoding = THREE.sRGBEncoding; plane.material.map = map; plane.material.needsUpdate = true; });
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
    if (this.model) this.model.visible = false;
    if (this.board) this.board.position.z = this.center.z - 0.9;
    if (this.older) this.scene.remove(this.older);
    this.older = this.shape;
    this.shape = shape;
    this.rising = { edge, height: 0 };
    this.scene.add(shape);
  }

  clearShapes() {
    for (const item of [this.board, this.shape, this.older]) if (item) this.scene.remove(item);
    this.board = this.shape = this.older = this.rising = null;
    if (this.model) this.model.visible = true;
  }

  rise(passed) {
    if (!this.rising) return;
    this.rising.height = still.matches ? 3 : this.rising.height + 2.2 * passed;
    this.rising.edge.constant = this.rising.height;
    if (this.rising.height > 2.4) { if (this.older) this.scene.remove(this.older); this.older = this.rising = null; this.shape.material.clippingPlanes = []; }
  }

  // --- drawing

  draw(now) {
    const passed = Math.min((now - this.last) / 1000, 0.1), { view, center, camera } = this;
    this.last = now;
    if (document.hidden) return;
    if (this.live) this.follow(passed);
    else if (this.running) this.step(passed);
    this.rise(passed);
    if (this.model && this.pose.quats.length) {
      this.bones.forEach((bone, index) => bone.quaternion.fromArray(this.pose.quats, 4 * index));
      this.bones[0].position.fromArray(this.pose.place);
      this.model.updateMatrixWorld(true);
      for (const mesh of this.meshes) for (const [name, index] of Object.entries(mesh.morphTargetDictionary)) mesh.morphTargetInfluences[index] = this.pose.face[name] || 0;
      this.speech.show(now / 1000);
    }
    const share = 1 - Math.exp(-4 * passed), [x, , z] = this.pose.place;
    center.x += (x - center.x) * share;
    center.z += (z - center.z) * share;
    this.contact.position.set(x, 0.002, z);
    const last = this.acts[this.acts.length - 1], off = last ? Math.atan2(Math.sin(last.heading - this.facing), Math.cos(last.heading - this.facing)) : 0;
    this.facing += off * (1 - Math.exp(-3 * passed));  // the camera goes round to where the person began to face
    const a = view.azimuth * Math.PI / 180 + this.facing, e = view.elevation * Math.PI / 180, wide = Math.max(1, 0.62 / camera.aspect);
    const head = this.close && this.skull ? this.skull.getWorldPosition(new THREE.Vector3()) : null, aim = head || center;
    camera.position.set(Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e)).multiplyScalar(view.distance * wide * (head ? 0.24 : 1)).add(aim);
    camera.position.y = Math.max(camera.position.y, 0.05);
    camera.lookAt(aim);
    const low = Math.min(0.09, 46 / this.element.clientHeight);  // the controls cover the lower edge
    camera.setViewOffset(this.element.clientWidth, this.element.clientHeight, 0, low * this.element.clientHeight * 0.6, this.element.clientWidth, this.element.clientHeight);
    this.sun.target.position.set(center.x, 0.9, center.z);
    this.sun.position.set(center.x + 1.9, 4.9, center.z + 2.8);
    this.rim.target.position.copy(this.sun.target.position);
    this.rim.position.set(center.x - 2.5, 3, center.z - 3.2);
    this.renderer.render(this.scene, camera);
    this.frames = (this.frames || 0) + 1;
    this.element.dataset.frames = this.frames;
  }
}

/** Whether the browser draws without a graphics card. */
function drawnByProcessor() {
  const context = document.createElement("canvas").getContext("webgl"), told = context && context.getExtension("WEBGL_debug_renderer_info");
  const name = told ? context.getParameter(told.UNMASKED_RENDERER_WEBGL) : "";
  if (context && context.getExtension("WEBGL_lose_context")) context.getExtension("WEBGL_lose_context").loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

const UP = { x: 0, y: 1, z: 0 };

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

/** The first animation of a file, as a clip that can be sampled. */
function cycleOf(gltf, model, bones) {
  const [animation] = gltf.animations, fps = 30, frames = Math.max(2, Math.round((animation ? animation.duration : 0) * fps) + 1);
  const clip = { fps, frames, bones: new Float32Array(4 * bones.length * frames), place: new Float32Array(3 * frames), face: {} };
  const mixer = new THREE.AnimationMixer(model), meshes = [];
  model.traverse(node => { if (node.isMesh && node.morphTargetDictionary) meshes.push(node); });
  if (animation) mixer.clipAction(animation).play();
  for (let frame = 0; frame < frames; frame++) {
    mixer.setTime(Math.min(frame / fps, (animation ? animation.duration : 0) - 1e-4));
    bones.forEach((bone, index) => bone.quaternion.toArray(clip.bones, 4 * (frame * bones.length + index)));
    bones[0].position.toArray(clip.place, 3 * frame);
    for (const mesh of meshes) for (const [name, index] of Object.entries(mesh.morphTargetDictionary)) {
      const value = mesh.morphTargetInfluences[index];
      if (value) (clip.face[name] ||= new Array(frames).fill(0))[frame] = value;
    }
  }
  mixer.stopAllAction();
  return clip;
}
