/* The bytes of courtyard.exr, between two symbols. */
        .section .rodata
        .global kiln_courtyard_begin
        .global kiln_courtyard_end
        .balign 16
kiln_courtyard_begin:
        .incbin KILN_COURTYARD
kiln_courtyard_end:
        .section .note.GNU-stack,"",%progbits
