// What the server sends, for `tsc --checkJs`. The page itself never loads this file.

export type Point = [number, number];
export interface Box {
    x: number;
    y: number;
    w: number;
    h: number;
    /** A rotated box or a polygon, around which the box is. The server has it beside the box. */
    outline?: Point[];
}
export type Status = 'tracked' | 'uncertain' | 'lost';
export interface Key {
    box: Box;
    outline?: Point[];
    occluded?: boolean;
    truncated?: boolean;
}
export interface TrackedBox {
    box: Box;
    score: number;
    status: Status;
    visible?: number | null;
    agreement?: number | null;
}
export interface Label {
    name: string;
    colour: string;
    attributes?: Attribute[];
}
export interface Attribute {
    name: string;
    kind: 'checkbox' | 'select' | 'number' | 'text';
    values?: string[];
    min?: number;
    max?: number;
    step?: number;
    length?: number;
    default: string;
    mutable: boolean;
}
export interface Target {
    id: number;
    label: string;
    attributes: Record<string, string>;
    changes?: Record<string, Record<string, string>>;
    keys: Record<string, Key>;
    tracked: Record<string, TrackedBox>;
    hidden: [number, number][];
}
export interface Project {
    video: { path: string; frames: number; width: number; height: number };
    labels: Label[];
    targets: Target[];
    done: boolean;
    remarks: Remark[];
}
export interface Remark {
    id: number;
    frame: number;
    target?: number;
    verdict: 'accepted' | 'rejected' | 'comment';
    text?: string;
}
export interface ClipInfo {
    id: number;
    name: string;
    frames: number;
    width: number;
    height: number;
    rate?: number | null;
    targets: number;
    keys: number;
    /** The number of frames of targets of which nothing is known. */
    unknown: number;
    /** The number of targets with such frames. */
    unknown_targets: number;
    done: boolean;
    error?: string | null;
    opening?: boolean;
    changed?: string | null;
}
export interface ClipState {
    revision: number;
    project: Project;
    colours: Record<string, string>;
    job: { target: number; state: string; waiting: number[] } | null;
    windows: number;
    file?: string;
    undo: string | null;
    redo: string | null;
    changed: string | null;
    notes: string[];
}
export interface ReviewSuggestion {
    target: number;
    frame: number;
    /** First and last frame of the stretch that the reason is about. */
    stretch: [number, number];
    gain: number;
    reason: string;
    /** Whether nothing is known of the stretch. */
    untracked: boolean;
}
export interface ReviewStats {
    boxes: number;
    expected: number;
    probable: number;
    unknown: number;
}
export interface ImportFormat {
    name: string;
    title: string;
    files: boolean;
}
export interface ExportFormat {
    name: string;
    title: string;
    content: string;
    folder: boolean;
    key_frames: boolean;
}
export interface Preview {
    targets: number;
    keys: number;
    boxes: number;
    first: number;
    last: number;
    labels: { name: string; targets: number; new: boolean }[];
    attributes: Record<string, string[]>;
    there: number;
    notes: string[];
    /** The first box of each target. */
    proposals: Proposal[];
}
export interface Proposal {
    frame: number;
    label: string;
    box: Box;
    score: number | null;
}
export interface VisibilityView {
    box: Box | null;
    corners: number[][] | null;
    score?: number | null;
    visible?: number | null;
    scales: { columns: number; rows: number; hidden: number[] }[];
    words: string[];
}
export type LiveBox = [number, number, number, number, number, number, Status, number | null];
export type Event =
    | { type: 'project'; revision: number }
    | { type: 'labels' }
    | { type: 'tracked'; target: number; boxes: LiveBox[]; fps: number; left: number | null }
    | { type: 'job'; state: 'running' | 'done' | 'stopped' | 'failed'; target: number; error?: string }
    | { type: 'queue'; waiting: number[] }
    | { type: 'history'; undo: string | null; redo: string | null }
    | { type: 'windows'; count: number };
export interface Edit {
    edit: string;
    [field: string]: unknown;
}
/** What to track; `since` is the revision of the change that it follows, and is undone with. */
export type TrackRequest = { target: number; until?: number; since?: number } & (
    { around: number } | { from: number; direction: Direction }
);
export type Direction = 'forward' | 'backward' | 'both';
/** What is known of a target in a frame. */
export interface TargetBox {
    kind: 'key' | 'tracked' | 'uncertain' | 'lost' | 'hidden' | 'none';
    box: Box | null;
    score: number | null;
    visible: number | null;
    agreement: number | null;
    occluded: boolean;
    truncated: boolean;
    live: boolean;
}
