// The page that lists all keys.

import { element, openDialog } from './dom.mjs';

/** @param {string} keys as in the table */
export function shown(keys) {
    const names = /** @type {Record<string, string>} */ ({
        ArrowLeft: '←',
        ArrowRight: '→',
        ArrowUp: '↑',
        ArrowDown: '↓',
        Escape: 'Esc',
        Delete: 'Del',
        PageUp: 'Page ↑',
        PageDown: 'Page ↓',
    });
    return keys
        .split(/\+(?!$)/)
        .map((key) => names[key] ?? key)
        .join('+');
}

/**
 * The page of keys.
 * @param {import('./commands.mjs').Command[]} commands
 */
export function openHelp(commands) {
    /** @type {Map<string, HTMLElement>} */
    const groups = new Map();
    for (const { group, name, keys, id } of commands) {
        if (/^label-[2-9]$/.test(id)) continue;
        const words = id === 'label-1' ? 'Label by its place in the list' : name;
        const marks = (id === 'label-1' ? ['1', '9'] : keys).map((key) =>
            element('kbd', { text: shown(key) }),
        );
        if (id === 'label-1') marks.splice(1, 0, element('span', { text: '…' }));
        const list = groups.get(group) ?? element('dl', {});
        groups.set(group, list);
        list.append(element('div', {}, element('dt', {}, ...marks), element('dd', { text: words })));
    }
    const sections = [...groups].map(([group, list]) =>
        element('section', {}, element('h3', { text: group }), list),
    );
    const mouse = element('p', {
        class: 'hint',
        text:
            'Drag on the frame to draw a box, drag a box or its handles to correct it: the frame ' +
            'becomes a key frame, and what lies between the neighbouring key frames is tracked again. ' +
            'Shift+drag draws a new box wherever it begins; otherwise, where the selected target is ' +
            'lost, a new box is its box. Wheel or pinch zooms, right or middle button pans. While a ' +
            'box is edited with keys, arrows move it, Shift+arrows resize it, with Ctrl by ten ' +
            'pixels. Drag the round handle to turn the box; with Shift it snaps to 15 degrees. While a polygon is ' +
            'drawn, Backspace removes its last point. Shift+drag in the row of a target below the frame marks a stretch, as S does: H ' +
            'says that it is not visible there, B tracks it again, Del deletes its boxes there. A square ' +
            'above the rows marks a frame with proposals.',
    });
    openDialog('Keys', [mouse, element('div', { class: 'help' }, ...sections)], { wide: true });
}
