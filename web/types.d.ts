// The types that modules share, for the checker alone: no browser loads this.

type Box = import("./js/session.js").Box;
type Answer = import("./js/stream.js").StreamAnswer;
type FrameStream = import("./js/stream.js").FrameStream;
type Client = import("./js/client.js").Client;
type Session = import("./js/session.js").Session;
type LocalClient = import("./js/local.js").LocalClient;
type LocalSession = import("./js/local.js").LocalSession;

type Chunk = import("./matroska.js").Chunk;
type FollowedObject = import("./objects.js").FollowedObject;
type Index = import("./indexer.js").Index;
type Keeping = import("./keeping.js").Keeping;
type Page = import("./page.js").Page;
type Run = import("./run.js").Run;

type Size = { width: number; height: number };

/** A frame as it is uploaded and as it is shown, in the same pixels. */
type Picture = {
  blob: Blob;
  image: HTMLCanvasElement | ImageBitmap;
  /** Seconds from the beginning of the video. */
  time: number;
  /** Its number in the video; that of the first is 0. */
  frame: number;
};

/** Where frames come from. */
type Source = {
  /** What results are named after. */
  name: string;
  /** Whether it goes on by itself, so that late frames are skipped. */
  isLive: boolean;
  /** In the video's own pixels. */
  size: Size;
  /** Frames a second, as far as is known. */
  rate: number | undefined;
  /** Frames that were not delivered. */
  skipped: number;
  /** The first frame. */
  first: () => Promise<Picture>;
  /** Delivers the frames after it. Fails where they cannot be had. */
  start: (deliver: (picture: Picture) => void, end: () => void) => Promise<void>;
  /** Stops delivering for a while. */
  hold: (isHeld: boolean) => void;
  /** Takes no more frames. */
  stop: () => void;
  /** Seconds, where one may begin anywhere. */
  duration?: number;
  /** How many frames there are, where that is known. */
  count?: number;
  /** Of any frame, where the times are known. */
  timeOf?: (frame: number) => number;
  /** The files of the frames, where each is one. */
  imageNames?: string[];
  /** Begins at a time, and gives its frame. */
  goTo?: (time: number, frame?: number) => Promise<Picture>;
  /** Any frame again. It works after `stop`, too. */
  at?: (frame: number, time: number) => Promise<Picture>;
  /** Gives up what `at` needs. */
  close?: () => void;
  /** Shows what is seen, until `first` is called. */
  preview?: (show: (image: HTMLCanvasElement) => void) => void;
  /** What is to be said once it is open. */
  note?: string;
  /** Whether its frames come over a line: one that fails may come later. */
  isFetched?: boolean;
  /** Whether its pictures are empty: the video of a project is not at hand. */
  isAbsent?: boolean;
  /** What can be kept of it, so that it can be opened again. */
  files?: File[];
};

/** Who is told of a run. */
type RunTold = {
  /** A frame is answered: what was answered for the chosen object. */
  answer: (picture: Picture, answer: Answer | undefined) => void;
  /** The source fails: it has no more frames that can be had. */
  fail: (error: unknown) => void;
  /** What tracks fails, or the line to the source. One can go on from there. */
  rest: (error: unknown) => void;
  /** A box that was drawn cannot be followed. Nothing has changed. */
  refuse: (error: unknown) => void;
  line: (isUp: boolean) => void;
  /** The service had lost a session: another one goes on from the last box. */
  anew: () => void;
  /** The source has no more frames, and all are answered. */
  end: () => void;
};

type Status = "tracking" | "uncertain" | "lost";

/** What is known of an object in a frame. */
type Row = {
  /** Its number in the video. */
  frame: number;
  /** Seconds from the beginning of the video. */
  time: number;
  /** In the video's own pixels. */
  box: Box;
  score: number;
  status: Status;
  /** Whether the box was drawn. */
  corrected: boolean;
};

/** The right box, where the user drew it; whether the answer tells what was seen. */
type Header = { box?: Box; see?: boolean };

/** What follows an object: a session in the page, or one of the service. */
type Follower = {
  open: (picture: Picture, box: Box) => Promise<Answer>;
  /** Goes on from there; the number of its frame. */
  restore: (saved: Uint8Array<ArrayBuffer>) => Promise<number>;
  /** Nothing for a frame that was skipped. */
  track: (picture: Picture, header: Header) => Promise<Answer | undefined>;
  save: () => Promise<Uint8Array<ArrayBuffer>>;
  /** A picture of what is kept of the object. */
  bag: () => Promise<Blob>;
  end: () => void;
};

/** The state of a tracker. */
type TrackerState = {
  bytes: Uint8Array<ArrayBuffer>;
  /** The frame of the video that each frame of the session was. */
  frames: number[];
  /** A frame of the video that it has seen: there may be later ones. */
  after?: number;
};

/** A row of a project file. `isKey`: the box was drawn. */
type StoredRow = [
  frame: number, time: number, x: number, y: number, width: number, height: number, score: number, status: Status,
  isKey: 0 | 1,
];

/** A project file. */
type Project = {
  /** The version. */
  bagtrack_project: 1;
  /** `live`: of a camera. */
  video: Size & { name: string; rate?: number; live?: boolean };
  /** Whether the whole video was tracked. */
  ended: boolean;
  /** Frames that were not tracked. */
  skipped: number;
  objects: { number: number; name: string; color: string; shown: boolean; rows: StoredRow[] }[];
};

/** What the browser keeps of a run. */
type Kept = {
  id: string;
  /** When it was kept, in milliseconds. */
  at: number;
  /** Whether it was tracked in the page. */
  isLocal: boolean;
  project: Project;
  /** The last one of each object. */
  states: Record<number, TrackerState>;
  /** The sample clip. */
  clip?: string;
  /** Of images. */
  imageNames?: string[];
};
