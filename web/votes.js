// The bag with its votes: a column for each subspace, with the vote as a bar above the mean and the basis.

/** Least number of columns. */
const PLACES = 10;
/** Vectors of a subspace that are shown: the mean and the first ones of the basis. */
const VECTORS = 3;
const GAP = 4;
/** The colour around the vectors in the service's picture of a bag. */
const GROUND = [24, 25, 28];
/** The vote with a bar of full height, unless one is larger. */
const FULL = 0.25;
/** The opacity of a subspace without votes. */
const FAINT = 0.45;

export class Votes {
  /**
   * @param {HTMLCanvasElement} bars
   * @param {HTMLCanvasElement} tiles
   */
  constructor(bars, tiles) {
    this.bars = bars;
    this.tiles = tiles;
    /** @type {{image: ImageBitmap, tiles: {x: number, y: number, width: number, height: number}[][]} | undefined} */
    this.bag = undefined;
    /** @type {number[]} One for each subspace, oldest first. */
    this.votes = [];
  }

  reset() {
    this.bag?.image.close();
    this.bag = undefined;
    this.tiles.hidden = true;
  }

  /** Takes the picture of a bag.
   * @param {Blob} blob */
  async take(blob) {
    const image = await createImageBitmap(blob);
    this.bag?.image.close();
    this.bag = { image, tiles: tilesOf(image) };
    this.tiles.hidden = false;
    this.show(this.votes);
  }

  /** @param {number[]} votes One for each subspace, oldest first. */
  show(votes) {
    this.votes = votes;
    if (votes.length === 0) return;
    const places = Math.max(PLACES, votes.length);
    this.paintBars(votes, places);
    this.paintTiles(votes, places);
    const most = votes.indexOf(Math.max(...votes));
    const text = `${votes.length} subspaces; number ${most + 1} has most, ${Math.round(100 * votes[most])} % of the vote`;
    this.bars.setAttribute("aria-label", text);
  }

  /**
   * @param {number[]} votes
   * @param {number} places
   */
  paintBars(votes, places) {
    const { context, width, height, step, wide } = fitted(this.bars, places);
    if (!context || width === 0) return;
    const style = getComputedStyle(this.bars);
    const text = 11 * devicePixelRatio;
    const scale = (height - 1.8 * text) / Math.max(FULL, ...votes);
    context.font = `${text}px system-ui, sans-serif`;
    context.textAlign = "center";
    for (let at = 0; at < places; at += 1) {
      const left = at * step;
      context.fillStyle = style.getPropertyValue("--line");
      context.fillRect(left, height - devicePixelRatio, wide, devicePixelRatio);
      if (at >= votes.length) continue;
      const high = Math.max(2 * devicePixelRatio, votes[at] * scale);
      context.fillStyle = style.getPropertyValue("--accent");
      context.globalAlpha = 0.6 + 0.4 * votes[at];
      context.beginPath();
      context.roundRect(left, height - high, wide, high, [3 * devicePixelRatio, 3 * devicePixelRatio, 0, 0]);
      context.fill();
      context.globalAlpha = 1;
      context.fillStyle = style.getPropertyValue("--soft");
      const told = Math.round(100 * votes[at]);
      if (told > 0) context.fillText(String(told), left + wide / 2, height - high - 0.5 * text);
    }
  }

  /**
   * @param {number[]} votes
   * @param {number} places
   */
  paintTiles(votes, places) {
    if (!this.bag) return;
    const { context, height, step, wide } = fitted(this.tiles, places);
    if (!context) return;
    const { image, tiles } = this.bag;
    const most = Math.max(...votes);
    const gap = GAP * devicePixelRatio;
    const high = (height - (VECTORS - 1) * gap) / VECTORS;
    context.imageSmoothingEnabled = false;
    tiles.forEach((vectors, at) => {
      context.globalAlpha = FAINT + (1 - FAINT) * Math.sqrt((votes[at] ?? 0) / most);
      vectors.slice(0, VECTORS).forEach(({ x, y, width, height }, below) => {
        context.drawImage(image, x, y, width, height, at * step, below * (high + gap), wide, high);
      });
    });
  }
}

/** Sizes a canvas to the pixels of the screen, and divides it into columns.
 * @param {HTMLCanvasElement} canvas
 * @param {number} columns */
function fitted(canvas, columns) {
  const width = (canvas.width = Math.round(canvas.clientWidth * devicePixelRatio));
  const height = (canvas.height = Math.round(canvas.clientHeight * devicePixelRatio));
  const gap = GAP * devicePixelRatio;
  const step = (width + gap) / columns;
  return { context: canvas.getContext("2d"), width, height, step, wide: step - gap };
}

/** Finds the rectangles of the vectors in the picture of a bag, by the background between them.
 * @param {ImageBitmap} image */
function tilesOf(image) {
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext("2d");
  if (!context) return [];
  context.drawImage(image, 0, 0);
  const down = runs(context.getImageData(GAP, 0, 1, image.height).data);
  const across = runs(context.getImageData(0, GAP, image.width, 1).data);
  return down.map(([y, height]) => across.map(([x, width]) => ({ x, y, width, height })));
}

/** The runs of pixels that are not background: start and length of each.
 * @param {Uint8ClampedArray} pixels */
function runs(pixels) {
  /** @type {[number, number][]} */
  const found = [];
  for (let at = 0, isIn = false; at < pixels.length / 4; at += 1) {
    const isGround = GROUND.every((value, channel) => pixels[4 * at + channel] === value);
    if (!isGround && !isIn) found.push([at, 0]);
    if (!isGround) found[found.length - 1][1] += 1;
    isIn = !isGround;
  }
  return found;
}
