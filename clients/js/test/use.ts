// How a strict TypeScript project uses the package: `tools/javascript_client.sh` checks that its types take it.

import { Client, LocalClient, Problem, type Answer, type Frame, type Image } from "bagtrack";
import { Tracker } from "bagtrack/tracker";

/** As the package `ws` declares its class, which is not that of a browser. */
declare class Socket {
  constructor(address: string | URL, protocols?: string | string[], options?: { handshakeTimeout?: number });
  onmessage: ((event: { data: string | ArrayBuffer; type: string }) => void) | null;
  onclose: ((event: { code: number; reason: string }) => void) | null;
  onerror: ((event: { error: unknown; message: string }) => void) | null;
  send(data: string | ArrayBufferLike, done?: (error?: Error) => void): void;
  close(code?: number, data?: string): void;
}

const box = { x: 10, y: 20, width: 30, height: 40 };

export async function serve(frames: Frame[]): Promise<Answer[]> {
  const client = new Client("http://localhost:8080", { WebSocket: globalThis.WebSocket ?? Socket });
  const other = new Client(new URL("http://localhost:8080"), { WebSocket: Socket, key: "key", patience: 5000 });
  const session = await client.open(frames[0], box, { preset: "robust", signal: AbortSignal.timeout(1000) });
  const stream = session.stream({ live: true });
  const answer = await stream.track(frames[1], { see: true });
  stream.close();
  await other.restore(await session.snapshot());
  return [...(await session.trackAll(frames)), ...(answer ? [answer] : [])];
}

export async function follow(images: Image[], video: HTMLVideoElement, stored: Blob): Promise<number | string> {
  const client = new LocalClient();
  const session = await client.open(video, box, { seed: 7 });
  const tracker = await Tracker.load(stored);
  try {
    for (const image of [...images, document.images[0]]) await client.track([session], image);
    return (await tracker.step(video)).score;
  } catch (problem) {
    return problem instanceof Problem ? problem.slug : "";
  } finally {
    tracker.free();
    await client.close();
  }
}
