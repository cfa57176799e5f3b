// Overlay with the list of keys.

/** @type {readonly [string, string][]} */
const KEYS = [
  ['/', 'search'],
  ['j  k  ↓  ↑', 'next, previous finding'],
  ['Enter', 'fly to the finding'],
  ['Esc', 'close, then clear'],
  ['f', 'all roads; the scenario, if it is one'],
  ['a', 'all roads of a scenario'],
  ['+  −', 'zoom'],
  ['Shift + arrows', 'move the map'],
  ['t', 'table or map'],
  ['↑ ↓ ← → Enter', 'in the timeline: move, close, open, choose'],
  ['d', 'dark or light'],
  ['?', 'this list'],
];

/** @param {readonly [string, string][]} keys */
function helpDialog(keys) {
  const rows = keys.map(([key, meaning]) =>
    make('tr', '', make('th', '', make('kbd', '', key)), make('td', '', meaning)),
  );
  const dialog = make('dialog', 'help', make('h2', '', 'Keys'), make('table', '', make('tbody', '', ...rows)));
  dialog.append(makeButton('tool', 'Close', () => dialog.close()));
  return withAttributes(dialog, { 'aria-label': 'Keys' });
}
