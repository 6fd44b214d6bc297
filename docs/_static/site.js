// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0

// A click on its picture, light or dark, puts an element to operate in its place.
for (const picture of document.querySelectorAll('a.operate')) {
  picture.addEventListener('click', (event) => {
    event.preventDefault()
    const element = Object.assign(document.createElement('iframe'), {
      className: 'operate', src: picture.href, title: 'An element to operate',
    })
    picture.replaceWith(element)
    element.focus()
  })
}

// The sidebar folds its sections. The one of this page is open, and the page's own line in view.
const tree = document.querySelector('.sidebar-tree')
for (const caption of tree?.querySelectorAll('.caption') ?? []) {
  const pages = caption.nextElementSibling
  const section = Object.assign(document.createElement('details'), {
    open: Boolean(pages.querySelector('.current')) || !tree.querySelector('.current'),
  })
  const title = document.createElement('summary')
  caption.before(section)
  title.append(caption.textContent)
  title.className = 'caption'
  caption.remove()
  section.append(title, pages)
}
const here = tree?.querySelector('.current-page'), scroller = tree?.closest('.sidebar-scroll')
if (here) scroller.scrollTop = here.getBoundingClientRect().top - scroller.getBoundingClientRect().top - scroller.clientHeight / 2

// What scrolls sideways can be reached with the keyboard, and both sidebars have names.
for (const wide of document.querySelectorAll('pre, .table-wrapper, div.math')) {
  if (wide.scrollWidth > wide.clientWidth) wide.tabIndex = 0
}
document.querySelector('.sidebar-drawer')?.setAttribute('aria-label', 'Pages')
document.querySelector('.toc-drawer')?.setAttribute('aria-label', 'On this page')
