// Outlines: rotated boxes and polygons. A box has its outline with it, and is the upright box around it.

/** @typedef {import('./types').Box} Box */
/** @typedef {import('./types').Point} Point */
/** @typedef {import('./drawing.mjs').Handle} Handle */

/** By how many pixels points may be off that were rounded to hundredths. */
const ROUNDING = 0.05;

/** @param {number} value */
const round = (value) => Math.round(value * 100) / 100;

/**
 * The upright box around points, with them as its outline unless they say no more.
 * @param {Point[]} points
 * @returns {Box}
 */
export function boxAround(points) {
    const outline = points.map(([x, y]) => /** @type {Point} */ ([round(x), round(y)]));
    const [xs, ys] = [outline.map(([x]) => x), outline.map(([, y]) => y)];
    const [x, y] = [Math.min(...xs), Math.min(...ys)];
    const box = { x, y, w: round(Math.max(...xs) - x), h: round(Math.max(...ys) - y) };
    const isUpright = isRectangle(outline) && Math.abs(areaOf(outline) - box.w * box.h) <= ROUNDING;
    return isUpright ? box : { ...box, outline };
}

/**
 * The fields of an edit that has a box.
 * @param {Box} box
 */
export function inEdit({ outline, ...box }) {
    return outline ? { box, outline } : { box };
}

/** @param {Point[]} points */
function areaOf(points) {
    const cross = points.map(([x, y], at) => {
        const [u = 0, v = 0] = points[(at + 1) % points.length] ?? [];
        return x * v - u * y;
    });
    return Math.abs(cross.reduce((sum, value) => sum + value, 0)) / 2;
}

/**
 * Whether the outline is a rectangle, turned or not: its diagonals are equal and halve each other.
 * @param {Point[]} outline
 */
export function isRectangle(outline) {
    const [a, b, c, d] = outline;
    if (!a || !b || !c || !d || outline.length > 4) return false;
    const middles = Math.max(Math.abs(a[0] + c[0] - b[0] - d[0]), Math.abs(a[1] + c[1] - b[1] - d[1])) / 2;
    const length = (/** @type {Point} */ p, /** @type {Point} */ q) => Math.hypot(p[0] - q[0], p[1] - q[1]);
    return Math.max(middles, Math.abs(length(a, c) - length(b, d))) <= ROUNDING;
}

/**
 * A box before it was turned clockwise around its centre, and by how many degrees; null of a polygon.
 * @param {Box} box
 */
export function rotatedBox({ outline, ...box }) {
    if (!outline) return { box, degrees: 0 };
    const [a, b, c, d] = outline;
    if (!isRectangle(outline) || !a || !b || !c || !d) return null;
    const [u, v] = [(b[0] - a[0] + c[0] - d[0]) / 2, (b[1] - a[1] + c[1] - d[1]) / 2];
    const [w, h] = [Math.hypot(u, v), Math.hypot(d[0] - a[0], d[1] - a[1])];
    const [x, y] = [(a[0] + c[0]) / 2, (a[1] + c[1]) / 2];
    const degrees = ((Math.atan2(v, u) * 180) / Math.PI + 360) % 360;
    return { box: { x: x - w / 2, y: y - h / 2, w, h }, degrees };
}

/** @param {Box} box @returns {Point} */
function centreOf({ x, y, w, h }) {
    return [x + w / 2, y + h / 2];
}

/** @param {Box} box @returns {Point[]} */
export function cornersOf({ x, y, w, h }) {
    return [
        [x, y],
        [x + w, y],
        [x + w, y + h],
        [x, y + h],
    ];
}

/**
 * A point that is turned clockwise around another one.
 * @param {Point} point
 * @param {number} degrees
 * @param {Point} around
 * @returns {Point}
 */
export function turnedPoint([x, y], degrees, [u, v]) {
    const [sin, cos] = [Math.sin((degrees * Math.PI) / 180), Math.cos((degrees * Math.PI) / 180)];
    return [u + (x - u) * cos - (y - v) * sin, v + (x - u) * sin + (y - v) * cos];
}

/**
 * A box that is turned clockwise around its centre.
 * @param {Box} box
 * @param {number} degrees
 */
export function turned(box, degrees) {
    const around = centreOf(box);
    return boxAround((box.outline ?? cornersOf(box)).map((point) => turnedPoint(point, degrees, around)));
}

/**
 * @param {Box} box
 * @param {number} dx
 * @param {number} dy
 * @returns {Box}
 */
export function moved({ x, y, w, h, outline }, dx, dy) {
    if (outline) return boxAround(outline.map(([u, v]) => [u + dx, v + dy]));
    return { x: x + dx, y: y + dy, w, h };
}

/**
 * Moves sides of an upright box.
 * @param {Box} box
 * @param {Handle} handle
 * @param {number} dx
 * @param {number} dy
 * @returns {Box}
 */
function sized({ x, y, w, h }, handle, dx, dy) {
    if (handle.includes('w')) [x, w] = [x + dx, w - dx];
    if (handle.includes('e')) w += dx;
    if (handle.includes('n')) [y, h] = [y + dy, h - dy];
    if (handle.includes('s')) h += dy;
    return { x, y, w, h };
}

/**
 * Moves sides of a box, which of a rotated one are those before it was turned; or a point of a polygon. By a
 * side, a polygon is stretched.
 * @param {Box} box
 * @param {Handle | number} handle
 * @param {number} dx
 * @param {number} dy
 * @returns {Box}
 */
export function resized(box, handle, dx, dy) {
    const { outline } = box;
    if (typeof handle === 'number') {
        const points = (outline ?? []).map(
            ([x, y], at) => /** @type {Point} */ (at === handle ? [x + dx, y + dy] : [x, y]),
        );
        return boxAround(points);
    }
    if (!outline) return sized(box, handle, dx, dy);
    const level = rotatedBox(box);
    if (level) {
        const [u, v] = turnedPoint([dx, dy], -level.degrees, [0, 0]);
        // The centre turns with the box, so that the other sides stay where they are.
        const around = centreOf(level.box);
        const points = cornersOf(sized(level.box, handle, u, v));
        return boxAround(points.map((point) => turnedPoint(point, level.degrees, around)));
    }
    const to = sized(box, handle, dx, dy);
    return boxAround(
        outline.map(([x, y]) => [
            to.x + ((x - box.x) * to.w) / Math.max(1, box.w),
            to.y + ((y - box.y) * to.h) / Math.max(1, box.h),
        ]),
    );
}

/**
 * The outline of a target whose box was one and is another: moved, and as much larger. A target without an
 * outline has the corners of its box.
 * @param {Box} from
 * @param {Box} to
 * @returns {Point[]}
 */
export function carried(from, to) {
    const by = Math.sqrt((to.w * to.h) / (from.w * from.h));
    const [[x, y], [u, v]] = [centreOf(from), centreOf(to)];
    return (from.outline ?? cornersOf(from)).map(([a, b]) => [u + by * (a - x), v + by * (b - y)]);
}

/**
 * A rotated box between two, at this share of the way; the angle takes the shorter way. Null of polygons.
 * @param {Point[]} first
 * @param {Point[]} second
 * @param {number} share
 */
export function between(first, second, share) {
    const [a, b] = [first, second].map((outline) => rotatedBox({ x: 0, y: 0, w: 0, h: 0, outline }));
    if (!a || !b) return null;
    const by = ((((b.degrees - a.degrees + 180) % 360) + 360) % 360) - 180;
    const mean = (/** @type {'x' | 'y' | 'w' | 'h'} */ side) =>
        a.box[side] + share * (b.box[side] - a.box[side]);
    const box = { x: mean('x'), y: mean('y'), w: mean('w'), h: mean('h') };
    return cornersOf(box).map((point) => turnedPoint(point, a.degrees + share * by, centreOf(box)));
}

/**
 * Width, height and angle in words, while a box is edited.
 * @param {Box} box
 */
export function sizeOf(box) {
    const level = rotatedBox(box);
    const { w, h } = level?.box ?? box;
    const angle = level && box.outline ? `, ${Math.round(level.degrees) % 360}°` : '';
    return `${Math.round(w)} × ${Math.round(h)}${angle}`;
}
