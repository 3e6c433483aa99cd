'use strict';
// A click on a heading sorts by its column: numbers in decreasing, text and ranks in increasing order;
// a second click reverses the order.
for (const table of document.querySelectorAll('table.sorts')) {
  const headings = [...table.tHead.rows[0].cells];
  headings.forEach((heading, column) => {
    const button = heading.querySelector('button');
    if (!button) return;
    button.addEventListener('click', () => {
      const down = heading.hasAttribute('aria-sort')
        ? heading.getAttribute('aria-sort') === 'ascending'
        : heading.dataset.down !== '0';
      headings.forEach((other) => other.removeAttribute('aria-sort'));
      heading.setAttribute('aria-sort', down ? 'descending' : 'ascending');
      const body = table.tBodies[0];
      const compare = (a, b) => {
        const [x, y] = [a.cells[column], b.cells[column]];
        if (x.dataset.value === undefined) {
          return (down ? -1 : 1) * x.textContent.localeCompare(y.textContent);
        }
        if (x.dataset.value === '' || y.dataset.value === '') {
          return (x.dataset.value === '') - (y.dataset.value === '');
        }
        return (down ? -1 : 1) * (x.dataset.value - y.dataset.value);
      };
      body.append(...[...body.rows].sort(compare));
    });
  });
}
const orders = [...document.querySelectorAll('[data-order]')];
for (const button of orders) {
  button.addEventListener('click', () => {
    orders.forEach((other) => other.setAttribute('aria-pressed', other === button));
    const rows = document.getElementById('rows');
    const key = button.dataset.order === 'auc' ? 'auc' : 'index';
    rows.append(...[...rows.children].sort((a, b) => a.dataset[key] - b.dataset[key]));
  });
}
