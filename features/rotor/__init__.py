"""The rotors of one record: combs of lines sought, fitted, told apart, and where they end. `find_family` does it all.

Modules, in the order in which a record passes through them
-----------------------------------------------------------
periodogram, strong_lines, slow_lines
    What is strong and slow is taken out, the noise made even; what then speaks for a line in each bin.
comb_scores, comb_search, flashes, octaves, folding, common_fraction, flash_rate, wide_line, one_sided, comb_centre,
unlike_blades, comb
    Where a comb may be, which of its multiples and fractions it is, which line is the body's, how wide that is, whether
    all lines lie on one side of it; or why there is no comb.
comb_fit, weak_lines, turning, turning_lines, drift, changing, changing_fit
    Combs fitted below the bin: steady ones, of blades not quite alike, of rates that change within the dwell.
gain, rotors, meeting, unresolved, points, left_flashes, like_lines, flash_count, helicopter
    A gain that all lines share; single rotors told apart, whether these are all, or blades are rows of a few points,
    whether one's comb is that of a turn; a main and a tail rotor.
line_shapes, line_likelihood, rotor_band, family_edge, past_edge
    Where the lines end: the tip; and whether blades still flash past that.
family
    All of these in their order.
refusals, even_pulses, sidebands
    What passes for a rotor in all of these and is another radar's or a supply's.
"""
