// Draws every figure, and says in the page what went wrong: a report that hides an error is worse than none.
(function () {
  const root = document.documentElement;
  let failed = 0;
  window.addEventListener("error", () => { root.dataset.errors = String(++failed); });
  root.dataset.errors = "0";
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  let chosen = null;
  const apply = () => root.classList.toggle("dark", chosen === null ? dark.matches : chosen);
  dark.addEventListener("change", apply);
  document.getElementById("theme").addEventListener("click", () => { chosen = !root.classList.contains("dark"); apply(); });
  // Paper is white.
  window.addEventListener("beforeprint", () => root.classList.remove("dark"));
  window.addEventListener("afterprint", apply);
  apply();
  const data = JSON.parse(document.getElementById("data").textContent);
  for (const figure of document.querySelectorAll("figure[data-chart]")) new Chart(figure, data[figure.dataset.chart]);
  for (const figure of document.querySelectorAll("figure[data-view]")) new View(figure, data[figure.dataset.view]);
  for (const table of document.querySelectorAll("table")) {
    const name = table.caption.textContent.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "").slice(0, 60);
    const button = html("button", table.caption, "CSV", "tool");
    table.caption.insertBefore(document.createTextNode(" "), button);
    button.addEventListener("click", () => {
      const quoted = cell => { const text = cell.textContent; return /[",\n]/.test(text) ? '"' + text.replace(/"/g, '""') + '"' : text; };
      const rows = [...table.rows].map(row => [...row.cells].map(quoted).join(","));
      download(name + ".csv", rows.join("\n") + "\n");
    });
  }
})();
