// The vehicle in three dimensions. Axes are those of the simulator: x north, y west, z up [m].
import { stand } from "./fit.js";
const { THREE } = globalThis;

const TRAIL = 3000;
/** Cells of the grid from its middle to its edge, cells between strong lines, and cells of the view's distance. */
const GRID = 50;
const STRONG = 10;
const CELLS = 12;
/** Half of the edge of a box around the vehicle that is seen whole [m], in arms at least. */
const NEAR_M = 1;
const NEAR_ARMS = 4;
/** What a whole view leaves free, of half the view: buttons lie above it, the legend below. */
const FREE = 0.2;
/** The ellipsoid is one of so many standard deviations: of the most that reach over at most half of the view. */
const SIGMAS = [3, 1, 0.3, 0.1, 0.03, 0.01];
const colour = (name) =>
  new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
const line = (points, name, extra = {}) => {
  const geometry = new THREE.BufferGeometry().setFromPoints(points.map((at) => new THREE.Vector3(...at)));
  return new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: colour(name), ...extra }));
};

/** A line that grows point by point and forgets its beginning. */
class Trail {
  constructor(name) {
    this.points = new Float32Array(3 * TRAIL);
    this.count = 0;
    this.box = new THREE.Box3();
    const geometry = new THREE.BufferGeometry();
    this.attribute = new THREE.BufferAttribute(this.points, 3);
    geometry.setAttribute("position", this.attribute);
    this.line = new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: colour(name) }));
    this.line.frustumCulled = false;
  }

  add(at) {
    const [x, y, z] = this.points.subarray(3 * (this.count - 1), 3 * this.count);
    if (this.count && Math.hypot(at[0] - x, at[1] - y, at[2] - z) < 0.03) return;
    if (this.count === TRAIL) {
      this.points.copyWithin(0, 3);
      this.count -= 1;
    }
    this.box.expandByPoint(new THREE.Vector3(...at));
    this.points.set(at, 3 * this.count);
    this.count += 1;
    this.attribute.needsUpdate = true;
    this.line.geometry.setDrawRange(0, this.count);
  }
}

/** The eight corners of a box. */
const corners = (low, high) =>
  Array.from({ length: 8 }, (_, i) => low.map((value, axis) => ((i >> axis) & 1 ? high[axis] : value)));

/** A floor with lines one apart, from -GRID to GRID, which fade into it. Neither hides anything, and each line is many
 * short ones: whoever draws long lines from behind the camera to the horizon may lose them. */
const ground = () => {
  const flat = { depthWrite: false };
  const floor = new THREE.Mesh(
    new THREE.CircleGeometry(100 * GRID, 64),
    new THREE.MeshBasicMaterial({ color: colour("floor"), ...flat }),
  );
  const [points, colours] = [[], []];
  const add = (x, y, line) => {
    points.push(x, y, 0);
    const fade = Math.max(1 - Math.hypot(x, y) / GRID, 0);
    colours.push(...colour("floor").lerp(line, fade).toArray());
  };
  for (let across = -GRID; across <= GRID; across += 1) {
    const line = colour(across % STRONG === 0 ? "grid-strong" : "grid");
    for (let along = -GRID; along < GRID; along += 1) {
      for (const end of [along, along + 1]) add(across, end, line);
      for (const end of [along, along + 1]) add(end, across, line);
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(points), 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(colours), 3));
  const grid = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: true, ...flat }));
  const group = new THREE.Group();
  group.add(floor, grid);
  [floor.renderOrder, grid.renderOrder] = [-2, -1];
  return group;
};

export class VehicleScene {
  /** `onPlace(place)` is called with a clicked place [x, y] on the ground's plane, `onSigmas(number)` with how many
   * standard deviations the ellipsoid shows. */
  constructor(canvas, onPlace, onSigmas) {
    this.canvas = canvas;
    this.onPlace = onPlace;
    this.onSigmas = onSigmas;
    // Kept, so that what is drawn can be read.
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.05, 2000);
    this.camera.up.set(0, 0, 1);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 1.55;
    this.controls.listenToKeyEvents(canvas);
    this.controls.keyPanSpeed = 14;
    this.controls.addEventListener("change", () => this.moved());
    this.controls.addEventListener("start", () => {
      this.whole = false;
    });
    this.follow = true;
    this.camera.position.set(-5.4, -4.4, 2.8);
    this.controls.update();
    let down = null;
    canvas.addEventListener("pointerdown", (event) => {
      down = [event.clientX, event.clientY];
    });
    canvas.addEventListener("pointerup", (event) => {
      const moved = down && Math.hypot(event.clientX - down[0], event.clientY - down[1]);
      if (moved !== null && moved < 5) this.pick(event);
    });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.hello && this.build(this.hello));
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.whole) this.seeAll();
    this.draw();
  }

  /** Follows the vehicle, seen from near, or stays where it is. */
  setFollow(follow) {
    [this.follow, this.whole] = [follow, false];
    if (follow) this.see(this.aroundVehicle());
  }

  /** Shows the vehicle, where it was and will be, and the fence, from the side that one looks from now; and goes on so
   * until somebody moves the view. */
  wholeView() {
    [this.follow, this.whole] = [false, true];
    this.seeAll();
  }

  seeAll() {
    const boxes = [new THREE.Box3().setFromObject(this.plan), this.trail.box, this.led.box];
    for (const object of [this.home, this.reference])
      if (object.visible) boxes.push(new THREE.Box3().setFromObject(object));
    const places = boxes.filter((box) => !box.isEmpty()).map(({ min, max }) => corners(min.toArray(), max.toArray()));
    this.see([...this.aroundVehicle(), ...places.flat()]);
  }

  /** Corners of a box around the vehicle. */
  aroundVehicle() {
    const at = this.at ?? [0, 0, 0];
    const reach = Math.max(NEAR_M, NEAR_ARMS * (this.hello?.arm_m ?? 0));
    return corners(
      at.map((value) => value - reach),
      at.map((value) => value + reach),
    );
  }

  /** Moves the camera, without turning it, to where these places are seen as large as they fit. */
  see(points) {
    const { camera, controls } = this;
    camera.updateMatrixWorld();
    const axis = (column) => new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, column).toArray();
    const [right, up, back] = [axis(0), axis(1), axis(2)];
    const along = (1 - FREE) * Math.tan((camera.fov * Math.PI) / 360);
    const axes = { right, up, forward: back.map((value) => -value) };
    const { position, middle } = stand(points, axes, [along * camera.aspect, along], 1);
    camera.position.set(...position);
    controls.target.set(...middle);
    controls.update();
    this.moved();
    this.draw();
  }

  /** Fits the ground and the depth of the view to how far the camera is. */
  moved() {
    const { camera, controls, ground } = this;
    const distance = Math.max(camera.position.distanceTo(controls.target), camera.position.z);
    [camera.near, camera.far] = [distance / 100, distance * 300];
    camera.updateProjectionMatrix();
    if (!ground) return;
    const power = 10 ** Math.floor(Math.log10(distance / CELLS));
    const cell = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size * CELLS >= distance);
    ground.scale.set(cell, cell, 1);
    // Strong lines stay at the same places.
    const snap = (value) => Math.round(value / (STRONG * cell)) * STRONG * cell;
    ground.position.set(snap(controls.target.x), snap(controls.target.y), 0);
  }

  /** Builds everything for a vehicle. */
  build(hello) {
    this.hello = hello;
    this.scene?.traverse((object) => {
      object.geometry?.dispose();
      object.material?.dispose?.();
    });
    const scene = new THREE.Scene();
    scene.background = colour("sky");
    scene.add(new THREE.HemisphereLight(0xffffff, 0x667788, 2.2));
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(-3, -4, 8);
    scene.add(sun);
    this.ground = ground();
    scene.add(this.ground);
    scene.add(
      new THREE.ArrowHelper(
        new THREE.Vector3(1, 0, 0),
        new THREE.Vector3(0, 0, 0.005),
        1,
        colour("front"),
        0.2,
        0.12,
      ),
    );
    scene.add(this.letter("N", [1.2, 0, 0.05]));

    this.vehicle = new THREE.Group();
    const solid = (name) => new THREE.MeshLambertMaterial({ color: colour(name) });
    const size = hello.arm_m;
    this.vehicle.add(new THREE.Mesh(new THREE.BoxGeometry(0.55 * size, 0.4 * size, 0.22 * size), solid("body")));
    const nose = new THREE.Mesh(new THREE.ConeGeometry(0.12 * size, 0.4 * size, 16), solid("front"));
    nose.rotation.z = -Math.PI / 2;
    nose.position.x = 0.45 * size;
    this.vehicle.add(nose);
    const reach = hello.rotors.map(({ position_m: [x, y] }) => Math.hypot(x, y));
    const radius = 0.42 * Math.min(...reach) * Math.min(1, 6 / hello.rotors.length + 0.1);
    this.rotors = hello.rotors.map(({ position_m: [x, y] }, i) => {
      const arm = new THREE.Mesh(new THREE.CylinderGeometry(0.04 * size, 0.04 * size, reach[i], 8), solid("body"));
      arm.position.set(x / 2, y / 2, 0);
      arm.rotation.z = Math.atan2(y, x) - Math.PI / 2;
      this.vehicle.add(arm);
      const disc = new THREE.Mesh(
        new THREE.CircleGeometry(radius, 32),
        new THREE.MeshBasicMaterial({
          color: colour(x > 0.3 * reach[i] ? "front" : "truth"),
          transparent: true,
          opacity: 0.35,
          side: THREE.DoubleSide,
        }),
      );
      disc.position.set(x, y, 0.12 * size);
      this.vehicle.add(disc);
      const thrust = new THREE.ArrowHelper(
        new THREE.Vector3(0, 0, 1),
        disc.position,
        0.01,
        colour("thrust"),
        0.05,
        0.04,
      );
      this.vehicle.add(thrust);
      return { disc, thrust };
    });
    scene.add(this.vehicle);

    this.trail = new Trail("truth");
    this.led = new Trail("reference");
    this.led.line.material.transparent = true;
    this.led.line.material.opacity = 0.6;
    scene.add(this.trail.line, this.led.line);
    const wire = (name, radius, opacity) =>
      new THREE.Mesh(
        new THREE.SphereGeometry(radius, 20, 14),
        new THREE.MeshBasicMaterial({ color: colour(name), wireframe: true, transparent: true, opacity }),
      );
    this.reference = wire("reference", 0.18 * size, 0.9);
    this.estimate = this.ellipsoid();
    this.believed = new THREE.Mesh(
      new THREE.SphereGeometry(0.1 * size, 16, 10),
      new THREE.MeshBasicMaterial({ color: colour("estimate") }),
    );
    this.windArrow = new THREE.ArrowHelper(
      new THREE.Vector3(1, 0, 0),
      new THREE.Vector3(),
      1,
      colour("wind"),
      0.2,
      0.14,
    );
    this.home = new THREE.Mesh(
      new THREE.RingGeometry(0.35, 0.42, 40),
      new THREE.MeshBasicMaterial({ color: colour("mission"), side: THREE.DoubleSide }),
    );
    this.shadow = new THREE.Mesh(
      new THREE.CircleGeometry(size, 32),
      new THREE.MeshBasicMaterial({ color: 0x000000, transparent: true, opacity: 0.18 }),
    );
    this.drop = line(
      [
        [0, 0, 0],
        [0, 0, 1],
      ],
      "grid-strong",
    );
    this.plan = new THREE.Group();
    this.planned = "";
    scene.add(
      this.reference,
      this.estimate,
      this.believed,
      this.windArrow,
      this.home,
      this.shadow,
      this.drop,
      this.plan,
    );
    this.scene = scene;
    this.resize();
  }

  /** Three circles and a faint skin, of radius 1. */
  ellipsoid() {
    const group = new THREE.Group();
    const circle = (place) =>
      line(
        Array.from({ length: 65 }, (_, i) => place(Math.cos((i * Math.PI) / 32), Math.sin((i * Math.PI) / 32))),
        "estimate",
        { transparent: true, opacity: 0.75 },
      );
    group.add(
      circle((c, s) => [c, s, 0]),
      circle((c, s) => [c, 0, s]),
      circle((c, s) => [0, c, s]),
    );
    group.add(
      new THREE.Mesh(
        new THREE.SphereGeometry(1, 32, 20),
        new THREE.MeshBasicMaterial({
          color: colour("estimate"),
          transparent: true,
          opacity: 0.05,
          depthWrite: false,
        }),
      ),
    );
    return group;
  }

  letter(text, at) {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 64;
    const context = canvas.getContext("2d");
    context.font = "bold 48px system-ui, sans-serif";
    context.textAlign = "center";
    context.fillStyle = `#${colour("front").getHexString()}`;
    context.fillText(text, 32, 50);
    const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: new THREE.CanvasTexture(canvas) }));
    sprite.position.set(...at);
    sprite.scale.setScalar(0.35);
    return sprite;
  }

  show(frame, draft) {
    if (!this.scene) return;
    const { truth, reference, estimate, rotors } = frame;
    const at = truth.position_m;
    if (this.follow && this.at) {
      const moved = new THREE.Vector3(at[0] - this.at[0], at[1] - this.at[1], at[2] - this.at[2]);
      this.camera.position.add(moved);
      this.controls.target.add(moved);
    }
    const first = !this.at;
    this.at = at;
    if (first) this.see(this.aroundVehicle());
    this.vehicle.position.set(...at);
    const [w, x, y, z] = truth.attitude;
    this.vehicle.quaternion.set(x, y, z, w);
    this.trail.add(at);
    // As long as the rotors that carry the weight together are 1.2 arms high each.
    const each = this.hello.weight_n / rotors.length;
    rotors.forEach(({ thrust_n: thrust, share }, i) => {
      const shown = this.rotors[i];
      const length = Math.max(0.005, (1.2 * this.hello.arm_m * thrust) / each);
      shown.thrust.setLength(length, Math.min(0.3 * length, 0.06), Math.min(0.2 * length, 0.05));
      shown.disc.material.opacity = 0.1 + 0.4 * share;
    });
    this.reference.visible = Boolean(reference);
    if (reference) {
      this.reference.position.set(...reference.position_m);
      if (frame.airborne) this.led.add(reference.position_m);
    }
    this.estimate.visible = Boolean(estimate?.valid);
    this.believed.visible = this.estimate.visible;
    if (this.estimate.visible) {
      this.believed.position.set(...estimate.position_m);
      this.estimate.position.set(...estimate.position_m);
      this.showSigma(estimate);
    }
    const wind = new THREE.Vector3(...frame.wind_m_s);
    const speed = wind.length();
    this.windArrow.visible = speed > 0.2;
    if (this.windArrow.visible) {
      this.windArrow.position.set(at[0], at[1], at[2] + 2.2 * this.hello.arm_m);
      this.windArrow.setDirection(wind.normalize());
      this.windArrow.setLength(0.25 * speed, Math.min(0.06 * speed, 0.25), Math.min(0.04 * speed, 0.16));
    }
    this.home.visible = Boolean(frame.home_m);
    if (frame.home_m) this.home.position.set(frame.home_m[0], frame.home_m[1], 0.01);
    this.shadow.position.set(at[0], at[1], 0.006);
    this.drop.position.set(at[0], at[1], 0);
    this.drop.scale.z = Math.max(at[2], 0.001);
    this.showPlan(frame, draft);
    if (this.whole) this.seeAll();
    this.draw();
  }

  /** Draws the ellipsoid of as many standard deviations as leave something else to be seen. */
  showSigma({ position_m: at, position_sigma_m: sigmas }) {
    const { camera } = this;
    const half = Math.tan((camera.fov * Math.PI) / 360) * Math.min(camera.aspect, 1);
    const most = 0.5 * half * camera.position.distanceTo(new THREE.Vector3(...at));
    const number = SIGMAS.find((sigma) => sigma * Math.max(...sigmas) <= most) ?? SIGMAS.at(-1);
    this.estimate.scale.set(...sigmas.map((sigma) => Math.min(Math.max(number * sigma, 0.01), most)));
    if (number !== this.sigmas) this.onSigmas(number);
    this.sigmas = number;
  }

  showPlan(frame, draft) {
    const now = JSON.stringify([frame.mission, frame.fence, frame.item, draft]);
    if (now === this.planned) return;
    this.planned = now;
    this.plan.traverse((object) => {
      object.geometry?.dispose();
      object.material?.dispose?.();
    });
    this.plan.clear();
    const ball = (at, name, radius) => {
      const mesh = new THREE.Mesh(
        new THREE.SphereGeometry(radius, 16, 10),
        new THREE.MeshLambertMaterial({ color: colour(name) }),
      );
      mesh.position.set(...at);
      this.plan.add(mesh);
    };
    const path = (points, name) => {
      points.forEach((at, i) => ball(at, name, frame.mission[i]?.number === frame.item ? 0.12 : 0.07));
      if (points.length > 1) this.plan.add(line(points, name));
    };
    path(
      frame.mission.map(({ position_m: at }) => at),
      "mission",
    );
    path(draft.waypoints, "mission");
    const wall = (corners, height, name) => {
      if (corners.length < 2) return corners.forEach(([x, y]) => ball([x, y, 0], name, 0.07));
      const closed = [...corners, corners[0]];
      for (const z of [0.01, height])
        this.plan.add(
          line(
            closed.map(([x, y]) => [x, y, z]),
            name,
          ),
        );
      corners.forEach(([x, y]) =>
        this.plan.add(
          line(
            [
              [x, y, 0],
              [x, y, height],
            ],
            name,
          ),
        ),
      );
      const triangles = closed.slice(1).flatMap(([x, y], i) => {
        const [u, v] = closed[i];
        return [u, v, 0, x, y, 0, x, y, height, u, v, 0, x, y, height, u, v, height];
      });
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(triangles), 3));
      this.plan.add(
        new THREE.Mesh(
          geometry,
          new THREE.MeshBasicMaterial({
            color: colour(name),
            transparent: true,
            opacity: 0.07,
            side: THREE.DoubleSide,
            depthWrite: false,
          }),
        ),
      );
    };
    for (const { corners_m: corners, radius_m: radius } of frame.fence) {
      const [[x, y]] = corners;
      const turn = (i) => [x + radius * Math.cos((i * Math.PI) / 24), y + radius * Math.sin((i * Math.PI) / 24)];
      wall(radius === null ? corners : Array.from({ length: 48 }, (_, i) => turn(i)), 3, "fence");
    }
    if (draft.corners.length) wall(draft.corners, 1, "fence");
  }

  /** Finds the place on the plane of the height that is flown. */
  pick(event) {
    const box = this.canvas.getBoundingClientRect();
    const pointer = new THREE.Vector2(
      ((event.clientX - box.left) / box.width) * 2 - 1,
      1 - ((event.clientY - box.top) / box.height) * 2,
    );
    const ray = new THREE.Raycaster();
    ray.setFromCamera(pointer, this.camera);
    const place = ray.ray.intersectPlane(new THREE.Plane(new THREE.Vector3(0, 0, 1), 0), new THREE.Vector3());
    if (place) this.onPlace([place.x, place.y]);
  }

  draw() {
    if (this.scene) this.renderer.render(this.scene, this.camera);
  }
}
