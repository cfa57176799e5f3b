// Prints the browser of the tests. Fails if none is found.

import { findChromium } from './browser.mjs';

const path = findChromium();
if (path) console.log(`browser: ${path}`);
process.exitCode = path ? 0 : 1;
