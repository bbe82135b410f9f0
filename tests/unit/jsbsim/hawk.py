"""A small aircraft of our own for JSBSim, with an autopilot that holds bank, altitude and airspeed, and a script that starts it."""

AIRCRAFT = """<?xml version="1.0"?>
<fdm_config name="hawk" version="2.0">
 <metrics>
  <wingarea unit="FT2"> 10 </wingarea> <wingspan unit="FT"> 9 </wingspan> <chord unit="FT"> 1.1 </chord>
  <location name="AERORP" unit="IN"><x>0</x><y>0</y><z>0</z></location>
 </metrics>
 <mass_balance>
  <ixx unit="SLUG*FT2"> 1.9 </ixx> <iyy unit="SLUG*FT2"> 1.5 </iyy> <izz unit="SLUG*FT2"> 1.9 </izz>
  <emptywt unit="LBS"> 13 </emptywt> <location name="CG" unit="IN"><x>0</x><y>0</y><z>0</z></location>
 </mass_balance>
 <ground_reactions/>
 <external_reactions>
  <force name="thrust" frame="BODY">
   <location unit="IN"><x>0</x><y>0</y><z>0</z></location> <direction><x>1</x><y>0</y><z>0</z></direction>
  </force>
 </external_reactions>
 <autopilot name="holds">
  <property>ap/bank_setpoint</property> <property>ap/altitude_setpoint</property> <property>ap/airspeed_setpoint</property>
  <property>ap/is_on</property>
  <channel name="all">
   <fcs_function name="ap/aileron"><function><product><property>ap/is_on</property><difference>
    <product><value>0.8</value><difference><property>ap/bank_setpoint</property><property>attitude/phi-rad</property></difference></product>
    <product><value>0.1</value><property>velocities/p-rad_sec</property></product></difference></product></function>
    <clipto><min>-0.4</min><max>0.4</max></clipto></fcs_function>
   <fcs_function name="ap/pitch"><function><sum><value>0.03</value><product><value>0.004</value><difference>
    <property>ap/altitude_setpoint</property><property>position/h-sl-ft</property></difference></product>
    <product><value>-0.006</value><property>velocities/h-dot-fps</property></product></sum></function>
    <clipto><min>-0.3</min><max>0.3</max></clipto></fcs_function>
   <fcs_function name="ap/elevator"><function><difference>
    <product><value>1.5</value><difference><property>ap/pitch</property><property>attitude/theta-rad</property></difference></product>
    <product><value>0.3</value><property>velocities/q-rad_sec</property></product></difference></function>
    <clipto><min>-0.4</min><max>0.4</max></clipto></fcs_function>
   <fcs_function name="ap/thrust"><function><sum><value>1.5</value><product><value>0.3</value><difference>
    <property>ap/airspeed_setpoint</property><property>velocities/vc-kts</property></difference></product></sum></function>
    <clipto><min>0</min><max>8</max></clipto><output>external_reactions/thrust/magnitude</output></fcs_function>
  </channel>
 </autopilot>
 <aerodynamics>
  <axis name="LIFT"><function name="aero/lift"><product><property>aero/qbar-area</property>
   <sum><value>0.3</value><product><value>4.6</value><property>aero/alpha-rad</property></product></sum></product></function></axis>
  <axis name="DRAG"><function name="aero/drag"><product><property>aero/qbar-area</property><value>0.04</value></product></function></axis>
  <axis name="SIDE"><function name="aero/side"><product><property>aero/qbar-area</property><value>-0.8</value>
   <property>aero/beta-rad</property></product></function></axis>
  <axis name="ROLL"><function name="aero/roll"><product><property>aero/qbar-area</property><property>metrics/bw-ft</property><sum>
   <product><value>0.15</value><property>ap/aileron</property></product>
   <product><value>-0.4</value><property>aero/bi2vel</property><property>velocities/p-aero-rad_sec</property></product></sum></product></function></axis>
  <axis name="PITCH"><function name="aero/pitching"><product><property>aero/qbar-area</property><property>metrics/cbarw-ft</property><sum>
   <product><value>-0.4</value><property>aero/alpha-rad</property></product>
   <product><value>0.8</value><property>ap/elevator</property></product>
   <product><value>-6</value><property>aero/ci2vel</property><property>velocities/q-aero-rad_sec</property></product></sum></product></function></axis>
  <axis name="YAW"><function name="aero/yaw"><product><property>aero/qbar-area</property><property>metrics/bw-ft</property><sum>
   <product><value>0.1</value><property>aero/beta-rad</property></product>
   <product><value>-0.15</value><property>aero/bi2vel</property><property>velocities/r-aero-rad_sec</property></product></sum></product></function></axis>
 </aerodynamics>
 <output name="datalog.csv" type="CSV" rate="10"> <simulation>ON</simulation> </output>
</fdm_config>
"""
START = """<?xml version="1.0"?>
<initialize name="start"> <vc unit="KTS">45</vc> <altitude unit="FT">600</altitude> <latitude unit="DEG">30</latitude> </initialize>
"""
SCRIPT = """<?xml version="1.0"?>
<runscript name="patrol">
 <use aircraft="hawk" initialize="start"/>
 <run start="0" end="10000" dt="0.01">
  <event name="on"><condition>simulation/sim-time-sec ge 0</condition><set name="ap/is_on" value="1"/><notify/></event>
 </run>
</runscript>
"""


def write(root):
    """Write the files of aircraft and script to a root folder of JSBSim. Returns its path."""
    for name, text in (
        ("aircraft/hawk/hawk.xml", AIRCRAFT), ("aircraft/hawk/start.xml", START), ("scripts/patrol.xml", SCRIPT)
    ):  # fmt: skip
        file = root / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    for name in ("engine", "systems"):
        (root / name).mkdir()
    return str(root)
