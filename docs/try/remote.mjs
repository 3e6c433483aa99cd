// Asks the worker, and waits for its answer.

/** @typedef {import('./types').Request} Request */
/** @typedef {import('./types').Answer} Answer */

export class Remote {
    #worker = new Worker(new URL('./worker.mjs', import.meta.url), { type: 'module' });
    #last = 0;
    /** @type {Map<number, { resolve: (answer: Answer) => void, reject: (error: Error) => void }>} */
    #waiting = new Map();

    constructor() {
        this.#worker.onmessage = (/** @type {MessageEvent<Answer>} */ { data }) => {
            const waiting = this.#waiting.get(data.id);
            this.#waiting.delete(data.id);
            if (data.error === undefined) waiting?.resolve(data);
            else waiting?.reject(new Error(data.error));
        };
        this.#worker.onerror = (event) => {
            event.preventDefault();
            const reason = 'the tracker could not be loaded: is this page opened from a web server?';
            for (const { reject } of this.#waiting.values()) reject(new Error(reason));
            this.#waiting.clear();
        };
    }

    /** @param {Request} request @returns {Promise<Answer>} */
    ask(request) {
        this.#last += 1;
        const id = this.#last;
        /** @type {Transferable[]} */
        let moved = [];
        if (request.kind !== 'network') moved = [request.picture];
        else if (request.files !== 'patchnet') moved = request.files;
        return new Promise((resolve, reject) => {
            this.#waiting.set(id, { resolve, reject });
            this.#worker.postMessage({ id, ...request }, moved);
        });
    }
}
