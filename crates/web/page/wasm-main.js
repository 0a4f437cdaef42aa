// The page as one file. `globalThis.simulator` is WebAssembly, compressed, in base64; the build defines `bindings`.
import { run } from "./app.js";
import { WasmEngine } from "./wasm-engine.js";
import initialise, * as bindings from "bindings";

const bytes = Uint8Array.from(atob(document.getElementById("simulator").textContent), (c) => c.charCodeAt(0));
const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
await initialise({ module_or_path: new Uint8Array(await new Response(stream).arrayBuffer()) });

const query = new URLSearchParams(location.search);
const engine = new WasmEngine(bindings.Playground, {
  scenario: query.get("scenario") ?? "outdoor",
  vehicle: query.get("vehicle") ?? "",
  seed: Number(query.get("seed") ?? 1),
});
const form = document.createElement("form");
form.innerHTML = `<h2>Flight</h2><div class="row">
  <label>scenario <select id="scenario"></select></label>
  <label>vehicle <select id="vehicle"></select></label>
  <label>seed <input id="seed" type="number" min="0" step="1"></label>
  <button type="button" class="main" id="restart">begin again</button></div>`;
document.getElementById("controls").prepend(form);
const field = (id) => document.getElementById(id);
field("scenario").append(...bindings.scenarios().map((name) => new Option(name, name)));
field("vehicle").append(...bindings.vehicles().map((name) => new Option(name, name)));
[field("scenario").value, field("seed").value] = [engine.choice.scenario, engine.choice.seed];
field("vehicle").value = engine.choice.vehicle || "paper";
field("restart").addEventListener("click", () => {
  engine.restart({
    scenario: field("scenario").value,
    vehicle: field("vehicle").value,
    seed: Number(field("seed").value),
  });
});
// For tests: the same flights as on the command line.
globalThis.fly = bindings.fly;
run(engine);
