// Boxes in the pixels that they are meant in: the video's own, or those that are tracked and shown.

/** A box in pixels of another size of the same picture.
 * @param {Box} box
 * @param {Size} to
 * @param {Size} from */
export function scaled(box, to, from) {
  if (to.width === from.width && to.height === from.height) return box;
  const [across, down] = [to.width / from.width, to.height / from.height];
  const rounded = (/** @type {number} */ value) => Number(value.toFixed(2));
  const [x, y] = [rounded(box.x * across), rounded(box.y * down)];
  return { x, y, width: rounded(box.width * across), height: rounded(box.height * down) };
}

/** What an answer tells of a frame, in the video's own pixels.
 * @param {Answer} answer
 * @param {Picture} picture
 * @param {Size} size Of the video.
 * @param {boolean} corrected */
export function rowOf({ box, score, status }, { frame, time, image }, size, corrected) {
  return { frame, time: Number(time.toFixed(3)), box: scaled(box, size, image), score, status, corrected };
}

/** What is shown of the objects in a frame.
 * @param {Run} run
 * @param {number} frame
 * @param {Size} image
 * @param {FollowedObject} [chosen] The one that stands out; all of them where there is none. */
export function shownIn({ objects, source }, frame, image, chosen) {
  const isNamed = objects.length > 1;
  return objects.flatMap((object) => {
    const { rows, name, color, isShown } = object;
    const row = rows.get(frame);
    if (!row || !isShown) return [];
    const box = scaled(row.box, image, source.size);
    const isChosen = !chosen || object === chosen;
    return [{ box, color, name: isNamed ? name : "", isLost: row.status === "lost", isChosen }];
  });
}
