// The WebAssembly module: loaded once in each thread.

import { ofNode } from "./platform.js";
import init from "./wasm/bagtrack_wasm.js";

/** @type {Promise<unknown> | undefined} */
let loading;

/** Loads the module. Everything of `wasm/bagtrack_wasm.js` needs it. */
export function load() {
  loading ??= read().then((source) => init({ module_or_path: source }));
  // One that could not be loaded is asked for again.
  loading.catch(() => (loading = undefined));
  return loading;
}

async function read() {
  const url = new URL("./wasm/bagtrack_wasm_bg.wasm", import.meta.url);
  if (url.protocol !== "file:") return url;
  // Node.js does not fetch files.
  return (await ofNode("fs/promises")).readFile(url);
}
