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

  // Fields of a form choose rows; the choice stays in the address.
  const form = document.querySelector("form.filters");
  if (form) {
    const rows = [...document.querySelectorAll("[data-verdict]")];
    const said = (row) => `${row.textContent} ${row.dataset.title ?? ""} ${Object.values(row.dataset).join(" ")}`;
    const entries = rows.map((row) => ({ row, text: said(row).toLowerCase(), data: row.dataset }));
    const address = new URLSearchParams(location.search);
    for (const field of form.elements) if (field.name) field.value = address.get(field.name) ?? "";
    const choose = () => {
      const wanted = [...new FormData(form)].filter(([, value]) => value.trim());
      const asked = (wanted.find(([name]) => name === "text")?.[1] ?? "").toLowerCase().split(/\s+/);
      const rest = wanted.filter(([name]) => name !== "text");
      let shown = 0;
      for (const { row, text: words, data } of entries) {
        row.hidden = !(asked.every((word) => words.includes(word)) && rest.every(([name, value]) => data[name].split(" ").includes(value)));
        shown += !row.hidden;
      }
      for (const part of new Set(rows.map((row) => row.closest("tbody, p.names")))) part.hidden = !part.querySelector("[data-verdict]:not([hidden])");
      for (const fold of document.querySelectorAll("details.fold")) { // what is looked for is seen, and failures always
        const any = fold.querySelector("[data-verdict]:not([hidden])");
        fold.open = (wanted.length > 0 && any) || "bad" in fold.dataset;
        fold.closest("details.group").hidden = !any;
      }
      for (const tile of document.querySelectorAll("a.tile")) { // a tile is a family: it counts its solves
        const mine = rows.filter((row) => row.dataset.family === tile.dataset.of && !row.hidden);
        tile.hidden = !mine.length;
        for (const badge of tile.querySelectorAll("[data-word]")) {
          const count = mine.filter((row) => row.dataset.verdict === badge.dataset.word).length;
          badge.hidden = !count;
          badge.textContent = `${count} ${badge.dataset.word}`;
        }
      }
      form.querySelector("output").value = `${shown} of ${rows.length} solves`;
      const query = new URLSearchParams(wanted).toString();
      history.replaceState(null, "", `${location.pathname}${query && `?${query}`}${location.hash}`);
    };
    form.addEventListener("input", choose);
    form.addEventListener("submit", (event) => event.preventDefault());
    form.addEventListener("reset", () => setTimeout(choose));
    choose();
  }
  addEventListener("beforeprint", () => document.querySelectorAll("article > details, details.fold").forEach((one) => { one.open = true; }));
});
