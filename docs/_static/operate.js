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
