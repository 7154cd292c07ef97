// A click on a heading sorts the rows below it, each group of rows for itself; again, backwards.
document.addEventListener("DOMContentLoaded", () => {
  const key = (row, column) => {
    const text = row.cells[column].innerText.trim();
    const number = parseFloat(text.replace("−", "-"));
    return /^[-−+]?[.\d]/.test(text) && !isNaN(number) ? number : text;
  };
  const compare = (a, b) =>
    typeof a === "number" && typeof b === "number" ? a - b
    : typeof a !== typeof b ? (typeof a === "number" ? -1 : 1)
    : a.localeCompare(b, undefined, { numeric: true });
  const sort = (table, column, sign) => {
    for (const body of table.tBodies) {
      const groups = [];
      for (const row of body.rows) {
        if (row.classList.contains("kind")) continue;
        if (row.classList.contains("why")) groups.at(-1).rows.push(row);
        else groups.push({ key: key(row, column), rows: [row] });
      }
      groups.sort((a, b) => sign * compare(a.key, b.key));
      for (const group of groups) body.append(...group.rows);
    }
  };
  for (const table of document.querySelectorAll("table.sortable")) {
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => {
      head.tabIndex = 0;
      const act = () => {
        const sign = head.ariaSort === "ascending" ? -1 : 1;
        heads.forEach((other) => other.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
        sort(table, column, sign);
      };
      head.addEventListener("click", act);
      head.addEventListener("keydown", (event) => { if (event.key === "Enter") act(); });
    });
  }
});
