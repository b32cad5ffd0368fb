/** Loads the module. Everything of `wasm/bagtrack_wasm.js` needs it. */
export declare function load(): Promise<unknown>;
