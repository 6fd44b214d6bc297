// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// Before anything is drawn: the theme that the user chose, or that of the system.
(() => {
  let chosen = null;
  try { chosen = localStorage.getItem('theme'); } catch { /* storage is turned off */ }
  const dark = chosen ? chosen === 'dark' : matchMedia('(prefers-color-scheme: dark)').matches;
  document.documentElement.dataset.theme = dark ? 'dark' : 'light';
})();
