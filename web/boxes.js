// Conversion of boxes between the pixels of the video and those of the picture that is tracked and shown, which may be
// smaller.

/** Converts a box from pixels of a picture of size `from` to those of the same picture of size `to`.
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

/** The row for an answer of the tracker: its box in pixels of the video, its time in seconds.
 * @param {Answer} answer
 * @param {Picture} picture
 * @param {Size} size Of the video.
 * @param {boolean} corrected */
export function rowOf({ box, score, status }, { frame, time, image }, size, corrected) {
  return { frame, time: Number(time.toFixed(3)), box: scaled(box, size, image), score, status, corrected };
}

/** The boxes to paint over a frame, in pixels of the picture.
 * @param {Run} run
 * @param {number} frame
 * @param {Size} image
 * @param {FollowedObject} [chosen] The object to emphasise; without one, all are. */
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
