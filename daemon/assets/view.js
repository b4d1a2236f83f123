// A view of a job's mesh that can be turned, with the places of its report. three.js is as published; all else is here.
import * as THREE from "./three/three.module.min.js";

const MAGIC = 0x31545553; // "SUT1"
const COLOURS = { lost: 0x8e24aa, invented: 0x00843d, open: 0xd60a28, changed: 0x1565c0, found: 0xb36b00, thin: 0x5d4037 };
const TURN = Math.PI / 36; // for a key
const REST = 3000; // milliseconds
const TRIES = 20;
const NAMES = { before: "As it came", after: "Result" };

const rest = () => new Promise((done) => setTimeout(done, REST));

// Others may be drawing: whoever is told to try again does.
async function ask(address) {
  for (let tries = 1; ; tries++) {
    const answer = await fetch(address);
    if (answer.status !== 503 || tries === TRIES) return answer;
    await rest();
  }
}

// The same for pictures.
async function see(image) {
  for (let tries = 1; tries < TRIES; tries++) {
    await image.decode().catch(() => {});
    if (image.naturalWidth) return;
    const answer = await fetch(image.src);
    if (!answer.ok && answer.status !== 503) return;
    if (!answer.ok) await rest();
    image.src = image.getAttribute("src");
  }
}

async function load(job, side) {
  const answer = await ask(`/v1/jobs/${job}/view?side=${side}`);
  if (!answer.ok) throw new Error((await answer.json()).detail);
  const bytes = await answer.arrayBuffer();
  const [magic, vertices, triangles, low, high] = new Uint32Array(bytes, 0, 5);
  if (magic !== MAGIC) throw new Error("the mesh cannot be understood");
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(bytes, 20, 3 * vertices), 3));
  geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(bytes, 20 + 12 * vertices, 3 * triangles), 1));
  geometry.computeBoundingBox();
  return { geometry, triangles, of: high * 2 ** 32 + low };
}

// The camera looks at a target from a direction and a distance; z is up.
class Orbit {
  constructor(camera) {
    Object.assign(this, { camera, target: new THREE.Vector3(), around: -Math.PI / 3, above: Math.PI / 6, far: 1 });
  }

  place() {
    this.above = Math.max(-1.5, Math.min(1.5, this.above));
    const flat = Math.cos(this.above) * this.far;
    const offset = new THREE.Vector3(Math.cos(this.around) * flat, Math.sin(this.around) * flat, Math.sin(this.above) * this.far);
    this.camera.position.copy(this.target).add(offset);
    this.camera.near = this.far / 1000;
    this.camera.far = this.far * 100;
    this.camera.updateProjectionMatrix();
    this.camera.lookAt(this.target);
  }

  fit(box) {
    box.getCenter(this.target);
    const radius = box.getSize(new THREE.Vector3()).length() / 2;
    this.far = (0.75 * Math.max(radius, 1e-6)) / Math.sin((this.camera.fov * Math.PI) / 360);
  }

  shift(right, up) {
    const step = this.far * Math.tan((this.camera.fov * Math.PI) / 360) * 2;
    const axes = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
    this.camera.matrixWorld.extractBasis(...axes);
    this.target.addScaledVector(axes[0], -right * step).addScaledVector(axes[1], up * step);
  }
}

class View {
  constructor(root) {
    this.root = root;
    this.job = root.dataset.view;
    this.stage = root.querySelector(".stage");
    this.meshes = new Map();
    this.markers = [];
  }

  async start() {
    this.status = document.createElement("p");
    this.status.setAttribute("role", "status");
    this.status.textContent = "The view is being made …";
    this.stage.append(this.status);
    try {
      this.sides = this.root.dataset.sides.split(" ");
      const first = await load(this.job, this.sides.at(-1));
      this.meshes.set(this.sides.at(-1), first);
      this.build(first.geometry.boundingBox);
    } catch (error) {
      this.status.textContent = `There is no view: ${error.message}. The pictures above show the mesh.`;
      return;
    }
    await this.show(this.sides.at(-1));
  }

  build(box) {
    this.middle = box.getCenter(new THREE.Vector3());
    this.size = box.getSize(new THREE.Vector3()).length() || 1;
    this.renderer = new THREE.WebGLRenderer({ antialias: true });
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0xf7f8fa);
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.1, 1000);
    this.camera.up.set(0, 0, 1);
    this.orbit = new Orbit(this.camera);
    this.orbit.fit(box.clone().translate(this.middle.clone().negate()));
    const light = new THREE.DirectionalLight(0xffffff, 2.2);
    light.position.set(0.4, 0.6, 1);
    this.camera.add(light);
    this.scene.add(this.camera, new THREE.AmbientLight(0xffffff, 1.1));
    this.body = new THREE.Group();
    this.scene.add(this.body);
    this.addCanvas();
    this.addSides();
    this.addPlaces();
    new ResizeObserver(() => this.draw()).observe(this.renderer.domElement);
  }

  addCanvas() {
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "The mesh. Arrow keys turn it, plus and minus change the distance, 0 shows all of it.");
    this.stage.prepend(canvas);
    const help = document.createElement("p");
    help.className = "soft";
    help.textContent = "Drag to turn, right button or Shift to shift, wheel for the distance; or arrow keys, + and −. 0 shows all.";
    this.stage.append(help);
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.change(() => (this.orbit.far *= Math.exp(event.deltaY / 1000)));
    }, { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    this.drag(canvas);
  }

  drag(canvas) {
    let moved = 0;
    canvas.addEventListener("pointerdown", (event) => {
      moved = 0;
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!canvas.hasPointerCapture(event.pointerId)) return;
      const [x, y] = [event.movementX / canvas.clientHeight, event.movementY / canvas.clientHeight];
      moved += Math.abs(event.movementX) + Math.abs(event.movementY);
      this.change(() => {
        if (event.shiftKey || event.buttons & 2) return this.orbit.shift(x, y);
        this.orbit.around -= x * 4;
        this.orbit.above += y * 4;
      });
    });
    canvas.addEventListener("click", (event) => {
      if (moved < 4) this.pick(event);
    });
  }

  key(event) {
    const orbit = this.orbit;
    const keys = {
      ArrowLeft: () => (orbit.around -= TURN),
      ArrowRight: () => (orbit.around += TURN),
      ArrowUp: () => (orbit.above += TURN),
      ArrowDown: () => (orbit.above -= TURN),
      "+": () => (orbit.far *= 0.85),
      "-": () => (orbit.far /= 0.85),
      0: () => orbit.fit(this.shown.box),
    };
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.change(keys[event.key]);
  }

  addSides() {
    if (this.sides.length < 2) return;
    const row = document.createElement("p");
    this.buttons = this.sides.map((side) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = NAMES[side];
      button.dataset.side = side;
      button.addEventListener("click", () => this.show(side));
      row.append(button, " ");
      return button;
    });
    this.stage.prepend(row);
  }

  addPlaces() {
    for (const item of this.root.querySelectorAll("li[data-box]")) {
      const numbers = item.dataset.box.split(" ").map(Number);
      const box = new THREE.Box3(new THREE.Vector3(...numbers.slice(0, 3)), new THREE.Vector3(...numbers.slice(3)));
      box.translate(this.middle.clone().negate());
      box.expandByScalar(this.size / 150);
      const colour = COLOURS[item.dataset.kind] ?? 0x333333;
      const extent = box.getSize(new THREE.Vector3());
      const material = new THREE.MeshBasicMaterial({ color: colour, transparent: true, opacity: 0, depthWrite: false });
      const marker = new THREE.Mesh(new THREE.BoxGeometry(extent.x, extent.y, extent.z), material);
      box.getCenter(marker.position);
      marker.add(new THREE.LineSegments(new THREE.EdgesGeometry(marker.geometry), new THREE.LineBasicMaterial({ color: colour })));
      const button = document.createElement("button");
      button.type = "button";
      button.setAttribute("aria-pressed", "false");
      button.append(...item.childNodes);
      item.append(button);
      // What is large would hide all else.
      const share = extent.length() / this.size;
      const place = { marker, button, box, share, faint: share > 0.25 ? 0 : 0.25, side: item.dataset.side };
      material.opacity = place.faint;
      button.addEventListener("click", () => this.choose(place, true));
      this.markers.push(place);
      this.scene.add(marker);
    }
  }

  pick(event) {
    const { left, top, width, height } = this.renderer.domElement.getBoundingClientRect();
    const at = new THREE.Vector2(((event.clientX - left) / width) * 2 - 1, 1 - ((event.clientY - top) / height) * 2);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(at, this.camera);
    // The smallest: it may lie in a large one.
    const hits = this.markers.filter((place) => ray.intersectObject(place.marker, false).length > 0);
    hits.sort((a, b) => a.share - b.share);
    if (hits.length) this.choose(hits[0], false);
  }

  // Shows one place; `go`: the camera comes near.
  async choose(place, go) {
    for (const other of this.markers) {
      const isIt = other === place;
      other.button.setAttribute("aria-pressed", String(isIt));
      other.marker.material.opacity = isIt ? Math.max(0.15, 2 * other.faint) : other.faint;
    }
    place.button.scrollIntoView({ block: "nearest" });
    if (this.sides.includes(place.side)) await this.show(place.side);
    this.change(() => {
      if (!go) return;
      this.orbit.fit(place.box);
      this.orbit.far = Math.max(this.orbit.far * 3.5, this.size / 20);
      // From outside, as far as the middle of all tells.
      const out = this.orbit.target;
      if (out.length() > this.size / 100) {
        this.orbit.around = Math.atan2(out.y, out.x);
        this.orbit.above = Math.atan2(out.z, Math.hypot(out.x, out.y));
      }
    });
  }

  async show(side) {
    try {
      if (!this.meshes.has(side)) this.meshes.set(side, await load(this.job, side));
    } catch (error) {
      this.status.textContent = `There is no view of it: ${error.message}.`;
      return;
    }
    const { geometry, triangles, of } = this.meshes.get(side);
    this.body.clear();
    const paint = (color, face) => new THREE.MeshStandardMaterial({ color, side: face, flatShading: true, roughness: 0.85, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    for (const material of [paint(0xb0bece, THREE.FrontSide), paint(0xf09632, THREE.BackSide)]) {
      const mesh = new THREE.Mesh(geometry, material);
      mesh.position.copy(this.middle).negate();
      this.body.add(mesh);
    }
    this.shown = { box: geometry.boundingBox.clone().translate(this.middle.clone().negate()) };
    for (const button of this.buttons ?? []) button.setAttribute("aria-pressed", String(button.dataset.side === side));
    const count = (n) => n.toLocaleString("en").replaceAll(",", " ");
    const part = triangles < of ? `, shown with ${count(triangles)} triangles of ${count(of)}` : "";
    this.status.textContent = `${NAMES[side]}${part}. Outside grey, inside orange.`;
    this.draw();
  }

  change(how) {
    how();
    this.draw();
  }

  draw() {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      const canvas = this.renderer.domElement;
      const [width, height] = [canvas.clientWidth, canvas.clientHeight];
      if (!width || !height) return;
      this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.orbit.place();
      this.renderer.render(this.scene, this.camera);
    });
  }
}

function begin() {
  for (const image of document.querySelectorAll("figure img:not([data-begun])")) {
    image.dataset.begun = "";
    see(image);
  }
  for (const root of document.querySelectorAll("[data-view]:not([data-begun])")) {
    root.dataset.begun = "";
    new View(root).start();
  }
}

begin();
// A report may come later than the page.
document.addEventListener("renewed", begin);
