import { existsSync } from 'node:fs';
import { defineConfig } from '@playwright/test';

const found = ['chromium-headless-shell', 'chromium', 'chromium-browser', 'google-chrome']
    .map((name) => `/usr/bin/${name}`)
    .find((path) => existsSync(path));
const args = ['--use-fake-device-for-media-stream', '--use-fake-ui-for-media-stream'];
// In containers the tests are run by root, for whom Chromium has no sandbox.
if (process.getuid?.() === 0) args.push('--no-sandbox');

// Chromium takes a page that was not read from the server for one of another network.
if (process.env.PATCHLOCK_PAGE) args.push('--disable-features=LocalNetworkAccessChecks');

export default defineConfig({
    testDir: 'tests',
    testMatch: '*.spec.mjs',
    outputDir: '../../target/studio/results',
    globalSetup: './tests/setup.mjs',
    // They end what hangs; a busy machine may take many times as long as an idle one.
    timeout: 300_000,
    expect: { timeout: 60_000 },
    globalTimeout: 1_800_000,
    maxFailures: 5,
    fullyParallel: true,
    workers: 2,
    reporter: 'line',
    use: {
        browserName: 'chromium',
        launchOptions: { executablePath: process.env.CHROMIUM ?? found, args },
        viewport: { width: 1280, height: 800 },
        acceptDownloads: true,
        // Without animations the processor is left to what is tested.
        contextOptions: { reducedMotion: 'reduce' },
        trace: process.env.PATCHLOCK_TRACE ? 'retain-on-failure' : 'off',
    },
});
