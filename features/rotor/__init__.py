"""The rotors of one record: search, fit and separation of combs of lines, and their edge. `find_family` runs it all.

Modules, in the order in which a record passes through them
-----------------------------------------------------------
periodogram, strong_lines, slow_lines
    Strong slow lines are taken out and the noise is whitened; then the evidence of a line in each bin.
comb_scores, comb_search, flashes, octaves, folding, common_fraction, flash_rate, wide_line, one_sided, half_comb,
comb_centre, unlike_blades, comb
    Search for a comb: which of the multiples and fractions of its spacing is right, which line is the body's, how wide
    that line is, whether all lines lie on one side of it; or why there is no comb.
comb_fit, weak_lines, turning, turning_lines, drift, changing, changing_fit
    Fits of combs to a fraction of a bin: at steady rates, of blades not quite alike, at rates that change in the dwell.
gain, candidate_rates, rotors, meeting, unresolved, points, left_flashes, like_lines, flash_count, helicopter
    A gain that all lines share; separation of single rotors; whether all rotors were found, whether blades are rows of
    a few points, whether the comb of a lone rotor is that of its rotation rate; a main and a tail rotor.
line_shapes, line_likelihood, rotor_band, family_edge, past_edge
    Where the lines end: the tip; and whether blades still flash past that.
family
    All of the above in that order.
refusals, even_pulses, sidebands
    Lines that pass for a rotor in all of the above, but are those of another radar or of a supply.
"""
