// Draws the charts of a page from the Vega-Lite specifications in it, when they come into view.
(() => {
  const night = matchMedia("(prefers-color-scheme: dark)");
  const drawn = new Map();
  let paper = false; // paper is light
  const dark = () => night.matches && !paper;
  const csv = (records) => {
    const names = [...new Set(records.flatMap(Object.keys))];
    const cell = (value) => {
      const text = String(value ?? "");
      return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
    };
    return [names, ...records.map((r) => names.map((n) => r[n]))].map((r) => r.map(cell).join(",")).join("\n");
  };
  const records = ({ series, fields, rows }) => rows.map((row) => ({
    ...(series === null ? {} : { series }), ...Object.fromEntries(row.map((value, i) => [fields[i], value])),
  }));
  const specification = (place) => {
    let text = place.querySelector("script").textContent;
    const theme = JSON.stringify(THEME.config);
    text = `{"config": ${theme}, ${text.trim().slice(1)}`;
    if (dark()) for (const [light, dark] of Object.entries(THEME.dark)) text = text.replaceAll(light, dark);
    const spec = JSON.parse(text);
    if (Array.isArray(spec.data)) spec.data = { values: spec.data.flatMap(records) }; // else of a former version
    const width = place.clientWidth - 38; // beside the menu
    const longest = Math.max(...spec.data.values.map((record) => (record.series ?? "").length));
    spec.config.legend.columns = Math.max(1, Math.floor(width / (40 + 6.3 * longest)));
    if (spec.width) { spec.width = width; spec.autosize = { type: "fit-x", contains: "padding" }; }
    for (const part of spec.vconcat ?? []) part.width = width - 70;
    return spec;
  };
  const draw = async (place) => {
    const spec = specification(place);
    const shown = place.querySelector(".drawn");
    drawn.get(place)?.finalize();
    const result = await vegaEmbed(shown, spec, {
      renderer: "svg",
      actions: { export: { svg: true, png: true }, source: false, compiled: false, editor: false },
      i18n: { SVG_ACTION: "SVG", PNG_ACTION: "PNG", CLICK_TO_VIEW_ACTIONS: "Save" },
      downloadFileName: place.id,
      tooltip: { theme: dark() ? "dark" : "light" },
    });
    drawn.set(place, result);
    if (!spec.width && !spec.vconcat) shown.classList.add("whole"); // as wide as it is, beside its menu
    place.querySelector(".none")?.remove();
    const link = document.createElement("a");
    link.textContent = "CSV";
    link.download = `${place.id}.csv`;
    link.href = `data:text/csv;charset=utf-8,${encodeURIComponent(csv(spec.data.values))}`;
    shown.querySelector(".vega-actions")?.append(link);
  };
  addEventListener("DOMContentLoaded", () => {
    const places = [...document.querySelectorAll(".chart")];
    const watch = new IntersectionObserver((entries) => {
      for (const { isIntersecting, target } of entries) {
        if (!isIntersecting) continue;
        watch.unobserve(target);
        draw(target);
      }
    }, { rootMargin: "500px" });
    places.forEach((place) => watch.observe(place));
    night.addEventListener("change", () => [...drawn.keys()].forEach(draw));
    addEventListener("beforeprint", () => {
      paper = true;
      places.filter((place) => night.matches || !drawn.has(place)).forEach(draw);
    });
    addEventListener("afterprint", () => { paper = false; if (night.matches) [...drawn.keys()].forEach(draw); });
    let width = innerWidth;
    addEventListener("resize", () => {
      if (width !== innerWidth) { width = innerWidth; [...drawn.keys()].forEach(draw); }
    });
  });
})();
