// Checks the pages in target/site, which tools/python/docs.sh builds: every link and every part leads somewhere,
// nothing comes from another site, no page is wider than its window, and axe finds no violation, at 390 and 1920
// pixels, in light and dark colours. Run it from any folder: `node tools/web/site.mjs`.

import { existsSync, readdirSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join, relative } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';
import studio from '../studio/playwright.config.mjs';

const require = createRequire(new URL('../studio/package.json', import.meta.url));
const { chromium } = require('@playwright/test');
const { default: AxeBuilder } = require('@axe-core/playwright');

const site = fileURLToPath(new URL('../../target/site', import.meta.url));
/** Buttons beside code, a `nav` without a name that the theme makes; and what Jupyter writes. */
const FOREIGN = ['.md-code__nav', '.jp-Notebook'];
/** What rustdoc writes is not looked at. */
const foreign = (path) => path.startsWith('rust/');
/** The pages; only those whose names begin as an argument says, if there is one. */
const pages = readdirSync(site, { recursive: true })
    .filter((path) => path.endsWith('.html') && !foreign(path) && path !== '404.html')
    .filter((path) => path.startsWith(process.argv[2] ?? ''))
    .sort();
const faults = new Set();

/** The ids of each page that is linked to. */
const ids = new Map();
/** @param {import('@playwright/test').Page} page */
const checkLinks = async (page, name) => {
    const found = await page.evaluate(() => ({
        ids: [...document.querySelectorAll('[id]')].map(({ id }) => id),
        links: [...document.querySelectorAll('a[href], link[href], [src]')].map(
            (element) => element.href ?? element.src,
        ),
    }));
    ids.set(join(site, name), new Set(found.ids));
    return found.links;
};

const browser = await chromium.launch(studio.use.launchOptions);
const links = [];
for (const colorScheme of ['light', 'dark']) {
    for (const width of [390, 1920]) {
        const context = await browser.newContext({
            colorScheme,
            viewport: { width, height: 900 },
            reducedMotion: 'reduce',
        });
        const page = await context.newPage();
        let name = '';
        page.on('request', (request) => {
            if (/^https?:/.test(request.url())) faults.add(`${name}: asks for ${request.url()}`);
        });
        for (name of pages) {
            await page.goto(pathToFileURL(join(site, name)).href);
            const wide = await page.evaluate(() => document.documentElement.scrollWidth);
            if (wide > width) faults.add(`${name}: ${wide} pixels wide in a window of ${width}`);
            const { violations } = await new AxeBuilder({ page })
                .exclude(FOREIGN[0])
                .exclude(FOREIGN[1])
                .analyze();
            for (const { id, nodes } of violations) {
                for (const { html } of nodes.slice(0, 3))
                    faults.add(`${name}, ${width} ${colorScheme}: ${id}: ${html.slice(0, 160)}`);
            }
            if (width === 1920 && colorScheme === 'light')
                links.push(...(await checkLinks(page, name)).map((link) => [name, link]));
        }
        await context.close();
    }
}
await browser.close();

for (const [name, link] of links.filter(([, link]) => link.startsWith('file:'))) {
    const url = new URL(link);
    const target = fileURLToPath(new URL(url.pathname, 'file:'));
    const part = decodeURIComponent(url.hash.slice(1));
    if (!existsSync(target)) faults.add(`${name}: ${relative(site, target)} does not exist`);
    else if (part && ids.get(target)?.has(part) === false)
        faults.add(`${name}: ${relative(site, target)} has no part ${part}`);
}
console.log(`${pages.length} pages, ${links.length} links`);
for (const fault of faults) console.error(fault);
process.exitCode = faults.size > 0 ? 1 : 0;
