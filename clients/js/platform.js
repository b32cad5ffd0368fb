// Access to the modules of Node.js.

/** A module of Node.js, for which no bundler shall look.
 * @param {string} name
 * @returns {Promise<any>} */
export function ofNode(name) {
  return import(/* @vite-ignore */ /* webpackIgnore: true */ `node:${name}`);
}
