// The vehicle in three dimensions. Axes are those of the simulator: x north, y west, z up [m].
const { THREE } = globalThis;

const TRAIL = 3000;
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
    this.points.set(at, 3 * this.count);
    this.count += 1;
    this.attribute.needsUpdate = true;
    this.line.geometry.setDrawRange(0, this.count);
  }
}

export class VehicleScene {
  /** `onPlace(place)` is called with a clicked place [x, y] on the ground's plane. */
  constructor(canvas, onPlace) {
    this.canvas = canvas;
    this.onPlace = onPlace;
    // Kept, so that what is drawn can be read.
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.05, 2000);
    this.camera.up.set(0, 0, 1);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 1.55;
    this.controls.listenToKeyEvents(canvas);
    this.controls.keyPanSpeed = 14;
    this.follow = true;
    this.height = 2;
    this.wholeView();
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
    this.draw();
  }

  wholeView() {
    this.controls.target.set(...(this.at ?? [0, 0, 1]));
    const [x, y, z] = this.controls.target.toArray();
    this.camera.position.set(x - 5.4, y - 4.4, z + 2.8);
    this.controls.update();
    this.draw();
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
    const floor = new THREE.Mesh(
      new THREE.CircleGeometry(400, 64),
      new THREE.MeshBasicMaterial({ color: colour("floor") }),
    );
    floor.position.z = -0.02;
    scene.add(floor);
    const grid = new THREE.GridHelper(80, 80, colour("grid-strong"), colour("grid"));
    grid.rotation.x = Math.PI / 2;
    scene.add(grid);
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
    } else if (!this.at) {
      this.at = at;
      this.wholeView();
    }
    this.at = at;
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
      this.estimate.scale.set(...estimate.position_sigma_m.map((sigma) => Math.min(Math.max(3 * sigma, 0.01), 50)));
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
    this.draw();
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
