# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A word in several elements: its digits, the code over them, and how it is written.

The code is a shortened Reed-Solomon code (1960): one digit per element, the last ones check
digits. An element of 2^m levels holds a number of the field GF(2^m), so nothing is packed or
split: a misread element is one wrong digit, an unreadable one is one erasure. With c check digits,
e erasures and w wrong digits are corrected if e + 2 w <= c; a code has at most 2^m - 1 elements.
If the number of levels is not a power of two, the next lower one is used (4 of 6). Elements of two
levels cannot carry such a code.

The *seal*, the last check digit, tells a complete word from a half-written one: its element is
blanked before any digit changes, and written when all others hold theirs. While the digits change
the seal is blank, which reads as a torn word. While the seal changes the digits are one whole
word, and the seal is one doubtful digit, which two check digits can correct. So after a crash a
read gives the old word, the new word, or an error; docs/bank.md says why the code alone does not
suffice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import comb
from threading import Lock

from mlmem_ros.contract.calls import RequestError
from mlmem_ros.packages import missing
from mlmem_ros.procedures import BLANK

POLYNOMIALS = {4: 0x7, 8: 0xB, 16: 0x13, 32: 0x25, 64: 0x43, 128: 0x83, 256: 0x11D}
"""The primitive polynomial of every field by its size: part of the stored format."""

Phase = Mapping[int, int]
"""Levels that are written at the same time, `BLANK` to erase, by the index of their element."""

_FIELD = Lock()
"""The library keeps its current field's tables in globals."""


class WordError(RequestError):
    """The elements do not hold a word.

    Attributes:
        read: Level of every element, -1 where it is blank, None where it could not be read.
    """

    def __init__(self, why: str, read: Sequence[int | None]) -> None:
        said = ' '.join('?' if level is None else str(level) for level in read)
        super().__init__(f'{why}; read, from element 0: {said}')
        self.read = tuple(read)


class TornWord(WordError):
    """A write or an erase was interrupted: the seal is blank."""


class LostWord(WordError):
    """More digits are wrong or unreadable than the code can correct."""


class WordCode:
    """Encodes words as the digits of elements, and decodes what is read from them.

    Attributes:
        base: Levels used per element.
        check: Number of check digits, held by the last elements; 0: no code, no seal.
    """

    def __init__(self, elements: int, base: int, check: int = 0) -> None:
        """Make a code.

        Args:
            base: Levels used per element, at least 2; with check digits a power of two.
            check: Number of check digits.

        Raises:
            ValueError: There is no such code; the message suggests the nearest one.
            ModuleNotFoundError: The library is missing (the extra `code`).
        """
        if base < 2:
            raise ValueError(f'base must be at least 2; got {base!r}')
        if not 0 <= check < elements:
            raise ValueError(f'check must be from 0 to {elements - 1}; got {check!r}')
        if check and base not in POLYNOMIALS:
            fits = max((size for size in POLYNOMIALS if size <= base), default=None)
            use = f'; use {fits} of the levels' if fits else ''
            raise ValueError(f'base must be a power of two from 4 to 256; got {base!r}{use}')
        if check and elements >= base:
            raise ValueError(
                f'elements must be at most {base - 1} where digits of base {base} are checked; '
                f'got {elements}'
            )
        self.elements, self.base, self.check = elements, base, check
        if check:
            try:
                import reedsolo
            except ModuleNotFoundError as error:
                raise ModuleNotFoundError(missing(error), name=error.name) from None
            self._none = reedsolo.ReedSolomonError
            with _FIELD:
                self._codec = reedsolo.RSCodec(
                    check, nsize=base - 1, c_exp=base.bit_length() - 1, prim=POLYNOMIALS[base]
                )

    @property
    def size(self) -> int:
        """Number of words: 0 ... size - 1."""
        return int(self.base ** (self.elements - self.check))

    def chance(self, unreadable: int = 0) -> float:
        """Return the probability that random digits, of which some are unreadable, pass for a
        word.

        It bounds the probability that damage beyond what the code can correct passes for a word.
        """
        readable, check = self.elements - unreadable, self.check - unreadable
        if check < 0:
            return 0.0  # such readings are refused
        near = sum(
            comb(readable, wrong) * (self.base - 1) ** wrong for wrong in range(check // 2 + 1)
        )
        return float(near / self.base**check)

    def digits(self, word: int) -> tuple[int, ...]:
        """Return the digits of a word: the least significant first, check digits last.

        Raises:
            ValueError: The word is not a whole number from 0 to `size` - 1.
        """
        if isinstance(word, bool) or not isinstance(word, int) or not 0 <= word < self.size:
            raise ValueError(
                f'word must be a whole number from 0 to {self.size - 1}; got {word!r}'
            )
        places = range(self.elements - self.check)
        return self._checked([word // self.base**place % self.base for place in places])

    def phases(self, digits: Sequence[int]) -> tuple[Phase, ...]:
        """Return the phases that write digits, or erase them if all are blank.

        Each phase begins when all elements of the previous one have confirmed their level.
        """
        whole = dict(enumerate(digits))
        if not self.check:
            return (whole,)
        seal = self.elements - 1
        last = {seal: whole.pop(seal)}
        return ({seal: BLANK}, whole, *([last] if last[seal] != BLANK else []))

    def decode(self, read: Sequence[int | None]) -> tuple[int, ...]:
        """Return the corrected digits; all of them are blank after an erasure.

        Args:
            read: Level of every element, -1 where it is blank, None where it could not be read.

        Raises:
            TornWord: A write has not ended.
            LostWord: Too many digits are unreadable, or they are too far from any word.
        """
        levels = [BLANK if level is None else level for level in read]
        if all(level == BLANK for level in read):
            return tuple(levels)
        if self.check and (read[-1] == BLANK or set(read[:-1]) == {BLANK}):
            raise TornWord('torn: a write has not ended, or the seal has lost its wall', read)
        erased = [place for place, level in enumerate(levels) if not 0 <= level < self.base]
        if not self.check and all(read[place] == BLANK for place in erased):
            return tuple(levels)
        if len(erased) > self.check:
            raise LostWord(
                f'lost: {len(erased)} of {self.elements} digits are unreadable; the code can '
                f'correct {self.check}',
                read,
            )
        lost = LostWord('lost: the digits are too far from any word', read)
        known = bytearray(0 if place in erased else level for place, level in enumerate(levels))
        try:
            with _FIELD:
                digits = tuple(self._codec.decode(known, erase_pos=erased)[1])
        except self._none:
            raise lost from None
        wrong = sum(
            digit != level
            for place, (digit, level) in enumerate(zip(digits, levels, strict=True))
            if place not in erased
        )
        data = digits[: self.elements - self.check]
        if len(erased) + 2 * wrong > self.check or self._checked(data) != digits:
            raise lost  # another user of the library may have changed its field
        return digits

    def _checked(self, data: Sequence[int]) -> tuple[int, ...]:
        """Return data digits followed by their check digits."""
        if not self.check:
            return tuple(data)
        with _FIELD:
            return tuple(self._codec.encode(bytearray(data)))
