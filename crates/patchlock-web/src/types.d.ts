/** The pixels of a frame: an `ImageData`, or an object with the same fields. */
export interface Pixels {
    /** Red, green, blue and alpha of each pixel, row by row. Alpha is ignored. */
    readonly data: Uint8ClampedArray | Uint8Array;
    readonly width: number;
    readonly height: number;
}

/** An upright box in pixels. The centres of pixels are at whole numbers. */
export interface Box {
    readonly x: number;
    readonly y: number;
    readonly w: number;
    readonly h: number;
}

export type Preset = 'robust' | 'paper' | 'network';

export type Status = 'tracked' | 'uncertain' | 'lost';

/** Which patches of one scale are visible, row by row in the target's own frame of reference. */
export interface VisibilityMap {
    readonly rows: number;
    readonly columns: number;
    readonly visible: boolean[];
}

/** Where the target is in a frame, and how sure that is. */
export interface Estimate {
    readonly bbox: Box;
    /** The corners of the outline, which may be turned: at first top left, top right, bottom right, bottom left. */
    readonly corners: [[number, number], [number, number], [number, number], [number, number]];
    /** How sure the tracker is, from 0 to 1. */
    readonly score: number;
    /** While the target is lost, the box is the last one that was known. */
    readonly status: Status;
    /** Undefined where the method does not know. */
    readonly visibility: { readonly large: VisibilityMap; readonly small: VisibilityMap } | undefined;
}
