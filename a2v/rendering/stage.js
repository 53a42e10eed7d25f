// The stage of our pages: light, ground and a camera that is turned by hand and goes along with somebody. Needs three.js as `THREE`.
"use strict";
function makeStage(element, home) {
  const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  renderer.outputEncoding = THREE.sRGBEncoding;
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = THREE.PCFSoftShadowMap;
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));

  const scene = new THREE.Scene();
  scene.background = new THREE.Color();
  scene.fog = new THREE.Fog(0, 8, 22);
  scene.add(new THREE.HemisphereLight(0xffffff, 0xb9b4ac, 0.75));
  const sun = new THREE.DirectionalLight(0xfff4e6, 0.55);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  Object.assign(sun.shadow.camera, { left: -2, right: 2, top: 2, bottom: -2, near: 0.5, far: 12 });
  sun.shadow.bias = -0.0005;
  sun.shadow.normalBias = 0.02;
  scene.add(sun, sun.target);
  const floor = new THREE.Mesh(new THREE.PlaneGeometry(80, 80), new THREE.ShadowMaterial({ opacity: 0.28 }));
  floor.rotation.x = -Math.PI / 2;
  floor.receiveShadow = true;
  floor.material.depthWrite = false;  // or it would hide the lines under it
  const light = new THREE.GridHelper(40, 80, 0x6b7278, 0x868d93), dark = new THREE.GridHelper(40, 80, 0x4a525a, 0x3a4149);
  light.position.y = dark.position.y = -0.002;
  scene.add(floor, light, dark);
  // the page's style decides on the background, light or dark
  const night = window.matchMedia("(prefers-color-scheme: dark)");
  const dress = () => {
    scene.background.set(getComputedStyle(element).backgroundColor);
    scene.fog.color.copy(scene.background);
    dark.visible = night.matches;
    light.visible = !night.matches;
  };
  night.addEventListener("change", dress);
  dress();

  const view = { ...home };
  const camera = new THREE.PerspectiveCamera(30, 1, 0.05, 100);
  const center = new THREE.Vector3(0, 0.9, 0);
  const resize = () => {
    const width = Math.max(element.clientWidth, 1), height = Math.max(element.clientHeight, 1);
    renderer.setSize(width, height);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
  };

  const fingers = new Map();
  const spread = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };
  const zoom = factor => { view.distance = Math.min(Math.max(view.distance * factor, home.distance / 8), home.distance * 5); };
  element.onpointerdown = event => { element.setPointerCapture(event.pointerId); fingers.set(event.pointerId, { x: event.clientX, y: event.clientY }); };
  element.onpointerup = element.onpointercancel = event => fingers.delete(event.pointerId);
  element.onpointermove = event => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    const before = fingers.size > 1 ? spread() : 0;
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (fingers.size > 1) { zoom(before / Math.max(spread(), 1)); return; }
    view.azimuth -= 0.4 * (event.clientX - last.x);
    view.elevation = Math.min(Math.max(view.elevation + 0.3 * (event.clientY - last.y), -20), 88);
  };
  element.addEventListener("wheel", event => { event.preventDefault(); zoom(Math.exp(event.deltaY * 0.001)); }, { passive: false });
  element.ondblclick = () => Object.assign(view, home);
  document.querySelectorAll("[data-azimuth]").forEach(button => {
    button.onclick = () => { view.azimuth = Number(button.dataset.azimuth); view.elevation = 0; };
  });

  return {
    scene, center,
    show() { new ResizeObserver(resize).observe(element); element.replaceChildren(renderer.domElement); resize(); },
    // stand so far away that somebody who reaches so far from the middle is seen whole
    fit(reach) { home.distance = view.distance = 1.15 * reach / Math.sin(camera.fov * Math.PI / 360); },
    // draw; the camera goes `share` of the way to where the person is, or looks at the face at `head`
    draw(where, share, head = null) {
      center.x += (where.x - center.x) * share;
      center.z += (where.z - center.z) * share;
      const a = view.azimuth * Math.PI / 180, e = view.elevation * Math.PI / 180;
      const wide = Math.max(1, 1 / camera.aspect);
      camera.position.set(Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e)).multiplyScalar(view.distance * wide * (head ? 0.22 : 1)).add(head || center);
      camera.position.y = Math.max(camera.position.y, 0.05);
      camera.lookAt(head || center);
      sun.target.position.set(center.x, 0.9, center.z);
      sun.position.set(center.x + 1.9, 4.9, center.z + 2.8);
      renderer.render(scene, camera);
    },
  };
}
