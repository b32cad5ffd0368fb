export type Image = import("./image.js").Image;
export type Box = import("./session.js").Box;
export type Calls = {
    open: {
        id: number;
        image: Image;
        box: Box;
        options?: import("./tracker.js").TrackerOptions;
    };
    restore: {
        id: number;
        snapshot: Uint8Array<ArrayBuffer>;
    };
    step: {
        image: Image;
        ids: number[];
        see?: boolean;
    };
    correct: {
        image: Image;
        id: number;
        box: Box;
    };
    save: {
        id: number;
    };
    read: {
        id: number;
    };
    bag: {
        id: number;
    };
    end: {
        id: number;
    };
};
