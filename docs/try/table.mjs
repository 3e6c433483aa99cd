// The table of a track, with the columns of `patchlock track --save track.csv`.

/** @typedef {import('./types').Row} Row */
/** @typedef {import('./patchlock/patchlock.js').VisibilityMap} VisibilityMap */

const COLUMNS =
    'frame,x,y,w,h,score,visible_large,visible_small,x1,y1,x2,y2,x3,y3,x4,y4,ms,status,frame_w,frame_h,time';

/** The visible share of a map. @param {VisibilityMap} map */
export const share = ({ visible }) => visible.filter(Boolean).length / Math.max(visible.length, 1);

/** A number with up to six decimal places. @param {number} value */
const rounded = (value) => {
    const number = Math.round(value * 1e6) / 1e6;
    // As the program writes: 5.0, not 5.
    return Number.isInteger(number) ? number.toFixed(1) : String(number);
};

/** @param {Row} row */
const line = ({ frame, time, width, height, ms, estimate }) => {
    const { bbox, corners, score, status, visibility } = estimate;
    const shares = visibility
        ? [visibility.large, visibility.small].map((map) => rounded(share(map)))
        : ['', ''];
    const numbers = [bbox.x, bbox.y, bbox.w, bbox.h, score].map(rounded);
    const outline = corners.flat().map(rounded);
    return [frame, ...numbers, ...shares, ...outline, rounded(ms), status, width, height, rounded(time)].join(
        ',',
    );
};

/** The text of the table. @param {readonly Row[]} rows */
export const table = (rows) => `${[COLUMNS, ...rows.map(line)].join('\n')}\n`;
