import type { Box, Estimate, Preset } from './patchlock/patchlock.js';

/** What the page asks of the tracker. */
export type Request =
    | { kind: 'network'; files: ArrayBuffer[] | 'patchnet' }
    | { kind: 'start'; picture: ImageBitmap; box: Box; preset: Preset }
    | { kind: 'update'; picture: ImageBitmap };

/** What it answers. */
export interface Answer {
    id: number;
    error?: string;
    network?: string;
    estimate?: Estimate;
    ms?: number;
}

/** A frame of the track. */
export interface Row {
    frame: number;
    /** Seconds from the start of the video. */
    time: number;
    width: number;
    height: number;
    /** Milliseconds of the tracker. */
    ms: number;
    estimate: Estimate;
}
