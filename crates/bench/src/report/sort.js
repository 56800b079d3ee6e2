"use strict";
// Tables are sorted by the column whose head is chosen: numbers by value, empty cells last. Cells have the text of their
// head for narrow pages.
for (const table of document.querySelectorAll("table")) {
  const number = text => /^[-+]?[\d.]/.test(text) ? parseFloat(text.replace(/(\d),(?=\d{3})/g, "$1")) : NaN;
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    for (const row of table.tBodies[0].rows) if (row.cells[column]) row.cells[column].dataset.head = head.textContent;
    const sort = () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const key = row => row.cells[column].textContent;
      const compare = (a, b) => {
        const [x, y] = [key(a), key(b)], [m, n] = [number(x), number(y)];
        if (isNaN(m) !== isNaN(n)) return isNaN(m) ? 1 : -1;
        return (isNaN(m) ? x.localeCompare(y) : m - n) * (up ? 1 : -1);
      };
      table.tBodies[0].append(...[...table.tBodies[0].rows].sort(compare));
    };
    head.tabIndex = 0;
    head.title = "Sort";
    head.addEventListener("click", sort);
    head.addEventListener("keydown", event => { if (event.key === "Enter") sort(); });
  });
}
