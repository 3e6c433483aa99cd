// How bright and how contrasty the picture is shown. Nothing but the screen changes by it.

import { byId } from './dom.mjs';

const STORED = 'patchlock-picture';
const SLIDERS = /** @type {const} */ (['brightness', 'contrast']);

/** The sliders over the picture. A step of one doubles, so that the middle is the picture as it is. */
export class Picture {
    constructor() {
        this.part = byId('picture-part');
        const stored = JSON.parse(sessionStorage.getItem(STORED) ?? '{}');
        for (const name of SLIDERS) {
            const slider = this.#slider(name);
            slider.value = String(stored[name] ?? 0);
            slider.addEventListener('input', () => this.#changed());
            // After a drag, keys belong to the clip again; with the keyboard, focus stays.
            slider.addEventListener('pointerup', () => byId('stage').focus({ preventScroll: true }));
        }
        byId('picture-reset').addEventListener('click', () => this.#reset());
        this.part.addEventListener('keydown', (event) => {
            if (event.key !== 'Escape') return;
            event.preventDefault();
            this.toggle();
        });
        this.#show();
    }

    /** @param {typeof SLIDERS[number]} name @returns {HTMLInputElement} */
    #slider(name) {
        return byId(name);
    }

    /** Opens the sliders, or closes them; what they say stays. */
    toggle() {
        this.part.hidden = !this.part.hidden;
        byId('picture-button').setAttribute('aria-expanded', String(!this.part.hidden));
        if (this.part.hidden) byId('stage').focus({ preventScroll: true });
        else this.#slider('brightness').focus();
    }

    #reset() {
        for (const name of SLIDERS) this.#slider(name).value = '0';
        this.#changed();
    }

    #changed() {
        const values = SLIDERS.map((name) => [name, this.#slider(name).valueAsNumber]);
        sessionStorage.setItem(STORED, JSON.stringify(Object.fromEntries(values)));
        this.#show();
    }

    #show() {
        const filters = SLIDERS.flatMap((name) => {
            const slider = this.#slider(name);
            const percent = `${Math.round(100 * 2 ** slider.valueAsNumber)}%`;
            slider.setAttribute('aria-valuetext', percent);
            const text = slider.nextElementSibling;
            if (text) text.textContent = percent;
            return slider.valueAsNumber === 0 ? [] : [`${name}(${percent})`];
        });
        byId('picture').style.filter = filters.join(' ');
        byId('picture-button').classList.toggle('adjusted', filters.length > 0);
    }
}
