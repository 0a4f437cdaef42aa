// Puts the page, its libraries and the simulator into one file: node playground.mjs BINDINGS FILE.
import { build } from "esbuild";
import { readFile, writeFile } from "node:fs/promises";
import { gzipSync } from "node:zlib";

const [bindings, file] = process.argv.slice(2);
const text = (path) => readFile(new URL(path, import.meta.url), "utf8");
const {
  outputFiles: [script],
} = await build({
  entryPoints: [new URL("page/wasm-main.js", import.meta.url).pathname],
  alias: { bindings: `${bindings}/playground.js` },
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  write: false,
  logLevel: "error",
});
const simulator = gzipSync(await readFile(`${bindings}/playground_bg.wasm`), { level: 9 }).toString("base64");
// A script ends at the first end tag, wherever it stands.
const inline = (source) => source.replaceAll("</script", "<\\/script");
const styles = [await text("vendor/uplot.min.css"), await text("page/style.css")];
const scripts = [await text("vendor/three.min.js"), await text("vendor/uplot.min.js")];
const licences = [await text("vendor/three.LICENSE"), await text("vendor/uplot.LICENSE")];
const head = `<!--\nthree.js and uPlot:\n${licences.join("\n")}-->\n<style>${styles.join("\n")}</style>`;
const tail = `<script type="text/plain" id="simulator">${simulator}</script>
${scripts.map((source) => `<script>${inline(source)}</script>`).join("\n")}
<script type="module">${inline(script.text)}</script>`;
const page = (await text("page/index.html"))
  .replace("<!-- head -->", () => head)
  .replace("<!-- tail -->", () => tail);
await writeFile(file, page);
const megabytes = (length) => `${(length / 1e6).toFixed(2)} MB`;
console.log(`${file}: ${megabytes(page.length)}, of which ${megabytes(simulator.length)} are the simulator`);
