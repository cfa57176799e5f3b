// Says which browser the tests will use; fails where there is none.

import { findChromium } from './browser.mjs';

const path = findChromium();
if (path) console.log(`browser: ${path}`);
process.exitCode = path ? 0 : 1;
