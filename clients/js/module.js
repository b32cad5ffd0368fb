// The WebAssembly module: loaded once in each thread.

import { ofNode } from "./platform.js";
import { Problem } from "./problem.js";
import init from "./wasm/bagtrack_wasm.js";

/** @type {Promise<unknown> | undefined} */
let loading;

/** Loads the module. Everything of `wasm/bagtrack_wasm.js` needs it. */
export function load() {
  loading ??= read().then((source) => init({ module_or_path: source })).catch(refuse);
  // One that could not be loaded is asked for again.
  loading.catch(() => (loading = undefined));
  return loading;
}

/** Says what could not be loaded: browsers say no more than that a fetch has failed, or that a page is no module.
 * @param {Error} error
 * @returns {never} */
function refuse(error) {
  const detail = `The tracker cannot be loaded from ${address()}: ${error.message}`;
  const problem = new Problem({ type: "internal", status: 500, detail });
  problem.cause = error;
  throw problem;
}

// Bundlers know the module by these very words.
const address = () => new URL("./wasm/bagtrack_wasm_bg.wasm", import.meta.url);

async function read() {
  const url = address();
  if (url.protocol !== "file:") return url;
  // Node.js does not fetch files.
  return (await ofNode("fs/promises")).readFile(url);
}
