// The WebAssembly module: loaded once in each thread.

import { ofNode } from "./platform.js";
import { Problem } from "./problem.js";
import init from "./wasm/bagtrack_wasm.js";

/** @type {Promise<unknown> | undefined} */
let loading;

/** Loads the module. Everything of `wasm/bagtrack_wasm.js` needs it. */
export function load() {
  loading ??= read().then((source) => init({ module_or_path: source })).catch(refuse);
  // After a failure the next call loads the module again.
  loading.catch(() => (loading = undefined));
  return loading;
}

/** Throws a problem that names the module's address: browsers say only that a fetch failed, or that a page is no
 * module.
 * @param {Error} error
 * @returns {never} */
function refuse(error) {
  const detail = `The tracker cannot be loaded from ${address()}: ${error.message}`;
  const problem = new Problem({ type: "internal", status: 500, detail });
  problem.cause = error;
  throw problem;
}

// Bundlers recognise the module by exactly this expression.
const address = () => new URL("./wasm/bagtrack_wasm_bg.wasm", import.meta.url);

async function read() {
  const url = address();
  if (url.protocol !== "file:") return url;
  // The `fetch` of Node.js takes no addresses of files.
  return (await ofNode("fs/promises")).readFile(url);
}
