// The list of clips, with a picture of each and how far it is.

import { byId, counted, element, icon } from './dom.mjs';
import { thumbnails } from './frames.mjs';

const THUMBNAIL = { width: 160, height: 90 };

export class ClipList {
    /** @param {import('./editor.mjs').Editor} editor */
    constructor(editor) {
        this.editor = editor;
        this.list = byId('clips');
        editor.addEventListener('clips', () => this.render());
        byId('clip-filter').addEventListener('input', () => this.render());
    }

    toggle() {
        const hidden = document.body.classList.toggle('without-clips');
        document.querySelector('[data-command=clips]')?.setAttribute('aria-expanded', String(!hidden));
    }

    render() {
        const { clips, clip } = this.editor;
        const ready = clips.filter(({ done }) => done).length;
        byId('clips-progress').textContent = clips.length ? `${ready} of ${clips.length} done` : '';
        const filter = /** @type {HTMLInputElement} */ (byId('clip-filter'));
        filter.hidden = clips.length < 8;
        const words = filter.value.toLowerCase();
        const matching = clips.filter(({ name }) => name.toLowerCase().includes(words));
        this.list.replaceChildren(...matching.map((info) => this.#entry(info, info.id === clip?.info.id)));
        this.list.querySelector('[aria-current]')?.scrollIntoView({ block: 'nearest' });
    }

    /**
     * @param {import('./types').ClipInfo} info
     * @param {boolean} current
     */
    #entry(info, current) {
        const picture = element('span', { class: 'clip-picture' });
        const path = `/clips/${encodeURIComponent(info.id)}`;
        if (!info.error && !info.opening) thumbnails.show(picture, { path, frame: 0, size: THUMBNAIL });
        const wrong = info.error ?? info.changed;
        const mark = info.done ? element('span', { class: 'clip-done' }, icon('done'), 'done') : null;
        const state = wrong ?? (info.opening ? 'opening …' : progress(info));
        const kind = wrong ? ' wrong' : info.targets && !info.done ? ' begun' : '';
        return element(
            'li',
            {},
            element(
                'button',
                {
                    class: 'clip',
                    attributes: {
                        type: 'button',
                        'aria-current': current ? 'true' : null,
                        title: info.name,
                        disabled: Boolean(info.error || info.opening),
                    },
                    on: { click: () => void this.editor.open(info) },
                },
                picture,
                element('span', { class: 'clip-name', text: info.name }),
                element('span', { class: `clip-state${kind}` }, mark, mark ? ` · ${state}` : state),
            ),
        );
    }
}

/** @param {import('./types').ClipInfo} info */
function progress({ targets, keys, done, unknown }) {
    const not = unknown ? ` · ${counted(unknown, 'frame')} not tracked` : '';
    if (targets > 0) return `${counted(targets, 'target')} · ${counted(keys, 'key')}${not}`;
    return done ? 'no targets' : 'not begun';
}
