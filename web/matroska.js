// Writes a video as WebM or Matroska (RFC 9559): frames with their times, the duration, and an index of the key frames.

/**
 * @typedef {object} Track
 * @property {"V_VP8" | "V_VP9" | "V_MJPEG"} codec
 * @property {number} width
 * @property {number} height
 *
 * @typedef {object} Chunk An encoded frame.
 * @property {number} time In milliseconds.
 * @property {boolean} isKey
 * @property {Uint8Array<ArrayBuffer>} bytes
 *
 * @typedef {(string | Uint8Array<ArrayBuffer>)[] } Pieces
 */

/** The ids of Matroska elements. */
const ID = {
  EBML: 0x1a45dfa3, DocType: 0x4282, DocTypeVersion: 0x4287, DocTypeReadVersion: 0x4285,
  Segment: 0x18538067, Info: 0x1549a966, TimestampScale: 0x2ad7b1, Duration: 0x4489,
  MuxingApp: 0x4d80, WritingApp: 0x5741,
  Tracks: 0x1654ae6b, TrackEntry: 0xae, TrackNumber: 0xd7, TrackUID: 0x73c5, TrackType: 0x83, FlagLacing: 0x9c,
  CodecID: 0x86, Video: 0xe0, PixelWidth: 0xb0, PixelHeight: 0xba,
  Cues: 0x1c53bb6b, CuePoint: 0xbb, CueTime: 0xb3, CueTrackPositions: 0xb7, CueTrack: 0xf7, CueClusterPosition: 0xf1,
  Cluster: 0x1f43b675, Timestamp: 0xe7, SimpleBlock: 0xa3,
};
/** In milliseconds. The time of a block within its cluster is a signed 16-bit number. */
const LONGEST_CLUSTER = 30_000;

/** A number in `length` bytes, big-endian.
 * @param {number} value
 * @param {number} length */
function big(value, length) {
  const bytes = new Uint8Array(length);
  for (let at = length - 1; at >= 0; at -= 1, value = Math.floor(value / 256)) bytes[at] = value % 256;
  return bytes;
}

/** @param {number} value */
const uint = (value) => big(value, 8);

/** @param {number} value */
function float(value) {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setFloat64(0, value);
  return bytes;
}

/** @param {string} text */
const ascii = (text) => new TextEncoder().encode(text);

/** @param {Uint8Array<ArrayBuffer>[]} pieces */
const total = (pieces) => pieces.reduce((sum, { length }) => sum + length, 0);

/** An element: its id, its length in eight bytes, its content.
 * @param {number} id
 * @param {...(Uint8Array<ArrayBuffer> | Uint8Array<ArrayBuffer>[])} content
 * @returns {Uint8Array<ArrayBuffer>[]} */
function element(id, ...content) {
  const pieces = content.flat();
  const size = big(total(pieces), 8);
  size[0] = 0x01;
  return [big(id, Math.ceil(Math.log2(id + 1) / 8)), size, ...pieces];
}

/** Groups frames into clusters: a new one at each key frame, and after `LONGEST_CLUSTER`.
 * @param {Chunk[]} chunks */
function clustered(chunks) {
  /** @type {Chunk[][]} */
  const clusters = [];
  for (const chunk of chunks) {
    const cluster = clusters.at(-1);
    if (!cluster || chunk.isKey || chunk.time - cluster[0].time > LONGEST_CLUSTER) clusters.push([chunk]);
    else cluster.push(chunk);
  }
  return clusters;
}

/** @param {Chunk[]} chunks */
function cluster(chunks) {
  const [{ time: begin }] = chunks;
  const blocks = chunks.flatMap(({ time, isKey, bytes }) => {
    const head = new Uint8Array([0x81, ...big(time - begin, 2), isKey ? 0x80 : 0]);
    return element(ID.SimpleBlock, head, bytes);
  });
  return element(ID.Cluster, element(ID.Timestamp, uint(begin)), blocks);
}

/** @param {Track} track */
function tracks({ codec, width, height }) {
  const video = element(ID.Video, element(ID.PixelWidth, uint(width)), element(ID.PixelHeight, uint(height)));
  const own = [element(ID.TrackNumber, uint(1)), element(ID.TrackUID, uint(1)), element(ID.TrackType, uint(1))].flat();
  const coded = [element(ID.FlagLacing, uint(0)), element(ID.CodecID, ascii(codec))].flat();
  return element(ID.Tracks, element(ID.TrackEntry, own, coded, video));
}

/** The index: where in the segment the clusters are that begin with a key frame.
 * @param {Chunk[][]} clusters
 * @param {number[]} positions */
function cues(clusters, positions) {
  const points = clusters.flatMap(([{ time, isKey }], index) => {
    if (!isKey) return [];
    const position = element(ID.CueClusterPosition, uint(positions[index]));
    const track = element(ID.CueTrackPositions, element(ID.CueTrack, uint(1)), position);
    return element(ID.CuePoint, element(ID.CueTime, uint(time)), track);
  });
  return element(ID.Cues, points);
}

/**
 * @param {Track} track
 * @param {Chunk[]} chunks In the order of their times; the first is a key frame.
 * @param {number} duration In milliseconds.
 * @returns {Blob}
 */
export function matroska(track, chunks, duration) {
  const isWebm = track.codec !== "V_MJPEG";
  const versions = [element(ID.DocTypeVersion, uint(4)), element(ID.DocTypeReadVersion, uint(2))].flat();
  const header = element(ID.EBML, element(ID.DocType, ascii(isWebm ? "webm" : "matroska")), versions);
  const apps = [element(ID.MuxingApp, ascii("bagtrack")), element(ID.WritingApp, ascii("bagtrack"))].flat();
  const info = element(ID.Info, element(ID.TimestampScale, uint(1e6)), element(ID.Duration, float(duration)), apps);
  const clusters = clustered(chunks);
  const written = clusters.map(cluster);
  // Every number has eight bytes, so the length of the index does not depend on the positions in it.
  const head = [...info, ...tracks(track)];
  let position = total(head) + total(cues(clusters, clusters.map(() => 0)));
  const positions = written.map((pieces) => {
    const own = position;
    position += total(pieces);
    return own;
  });
  const segment = element(ID.Segment, head, cues(clusters, positions), written.flat());
  return new Blob([...header, ...segment], { type: isWebm ? "video/webm" : "video/x-matroska" });
}
