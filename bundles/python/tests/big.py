"""A large generated map."""


def big_map(megabytes: int) -> str:
    """Returns a map of about this size, with 400,000 elements for each 10 MB."""
    geometry = "".join(
        f'      <geometry s="{5 * n}.0000000000000000e+00" x="{5 * n}.25" y="-1.5e-3" hdg="0.125" length="5.0">'
        "<line/></geometry>\n"
        for n in range(40)
    )
    lanes = "".join(
        f'          <lane id="-{n}" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>\n'
        for n in range(1, 5)
    )
    sections = "".join(
        f'      <laneSection s="{50 * n}"><center><lane id="0" type="none" level="false"/></center><right>\n{lanes}'
        "      </right></laneSection>\n"
        for n in range(4)
    )
    road = (
        'name="road" length="200" junction="-1">\n    <planView>\n'
        f"{geometry}    </planView>\n    <lanes>\n{sections}    </lanes>\n  </road>\n"
    )
    head, tail = '<OpenDRIVE>\n  <header revMajor="1" revMinor="8"/>\n', "</OpenDRIVE>\n"
    count = (megabytes * 1_000_000) // (len(road) + 20)
    return head + "".join(f'  <road id="{n}" {road}' for n in range(count)) + tail
