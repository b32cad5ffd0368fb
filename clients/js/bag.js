// The bag as a picture: a row for each affine subspace, its mean, then the columns of its basis.

const CELL = 8;
const GAP = 4;
const GROUND = "#18191c";

/**
 * @param {{columns: number, vectors: Float32Array[]}[]} bag
 * @returns {Promise<Blob>}
 */
export function pictureOf(bag) {
  const { columns, vectors } = bag[0];
  const across = Math.max(...bag.map((entry) => entry.vectors.length));
  const [width, height] = [columns * CELL + GAP, (vectors[0].length / columns) * CELL + GAP];
  const canvas = new OffscreenCanvas(across * width + GAP, bag.length * height + GAP);
  const context = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.fillStyle = GROUND;
  context.fillRect(0, 0, canvas.width, canvas.height);
  bag.forEach((entry, row) =>
    entry.vectors.forEach((vector, column) => draw(context, vector, columns, GAP + column * width, GAP + row * height)),
  );
  return canvas.convertToBlob();
}

/** Draws a vector in gray, from its least value (black) to its greatest (white). With values of both signs, 0 is
 * mid-gray.
 * @param {OffscreenCanvasRenderingContext2D} context
 * @param {Float32Array} vector
 * @param {number} columns
 * @param {number} left
 * @param {number} top */
function draw(context, vector, columns, left, top) {
  const [least, most] = [Math.min(...vector), Math.max(...vector)];
  const reach = Math.max(-least, most);
  const [from, to] = least < 0 && most > 0 ? [-reach, reach] : [least, most];
  vector.forEach((value, at) => {
    const gray = Math.round((255 * (value - from)) / (to - from || 1));
    context.fillStyle = `rgb(${gray} ${gray} ${gray})`;
    context.fillRect(left + (at % columns) * CELL, top + Math.floor(at / columns) * CELL, CELL, CELL);
  });
}
